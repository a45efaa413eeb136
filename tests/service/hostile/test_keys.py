"""What somebody with a wrong key, or one that has ended, learns and gets."""

import asyncio
import hmac
import json
import threading
import time
from collections.abc import AsyncIterator, Callable
from datetime import timedelta
from typing import Any

import httpx
import pytest
from sqlalchemy import event

from db.database import Database
from db.paging import Window
from db.records import AuditFilter, LogFilter
from db.repositories import access_keys, audit, grasp_logs
from db.tables import now
from service import cli
from service.cli.durations import moment_to_come
from service.domain.access import keys
from service.domain.access.keys import NoKeys, check_start
from service.http.middleware import authentication
from service.settings import Settings

Reach = Callable[..., Any]
Make = Callable[..., str]
NEWEST = Window("id", descending=True)
ONLY_SQLITE = pytest.mark.parametrize("engine_name", ["sqlite"], indirect=True)


def test_a_key_ends_to_the_moment(reach: Reach, make: Make, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(authentication, "KEPT_SECONDS", 60.0)
    client = reach(key=make(expires_at=now() + timedelta(seconds=1.5)))
    assert client.get("/v1/materials").status_code == httpx.codes.OK
    time.sleep(1.6)
    answer = client.get("/v1/materials")
    assert (answer.status_code, answer.json()["type"]) == (401, "/problems/invalid-key")


def test_a_key_that_has_expired_does_not_start_a_service(database: Database, make: Make) -> None:
    settings = Settings(host="0.0.0.0")
    make(expires_at=now() - timedelta(seconds=1))
    with pytest.raises(NoKeys):
        check_start(settings, database)
    make(expires_at=now() + timedelta(hours=1))
    check_start(settings, database)


@ONLY_SQLITE
def test_a_refusal_takes_the_same_steps_whether_the_id_is_stored_or_not(
    reach: Reach, make: Make, database: Database, monkeypatch: pytest.MonkeyPatch
) -> None:
    text, client, steps = make(), reach(), list[str]()
    compare = hmac.compare_digest

    def note_comparison(one: str, other: str) -> bool:
        steps.append("compared")
        return compare(one, other)

    def note_query(_connection: object, _cursor: object, statement: str, *_rest: object) -> None:
        steps.extend(["asked"] if "access_keys" in statement else [])

    monkeypatch.setattr(hmac, "compare_digest", note_comparison)
    event.listen(database.engine, "before_cursor_execute", note_query)

    def taken(key: str) -> list[str]:
        steps.clear()
        client.headers = {"Authorization": f"Bearer {key}"}
        client.get("/v1/materials")
        return list(steps)

    begins = ["compared"]  # among the requests of its key, where it was one before
    assert taken(text) == [*begins, "compared", "asked", "compared"]
    assert taken(text) == [*begins, "compared"]
    wrong = text[:-1] + ("0" if text[-1] != "0" else "1")
    assert taken(wrong) == taken(keys.new_key()[1]) == taken(wrong) == [*begins, "compared", "asked", "compared"]
    event.remove(database.engine, "before_cursor_execute", note_query)


@ONLY_SQLITE
def test_no_answer_repeats_what_was_sent_as_a_key(reach: Reach, make: Make, caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level("DEBUG")
    text = make()
    for sent in (text, f"Basic {text}", f"Bearer {text}0", f"Bearer{text}", f"Token {text}"):
        client = reach()
        client.headers = {"Authorization": sent}
        answer = client.get("/v1/materials")
        assert answer.status_code == httpx.codes.UNAUTHORIZED
        assert text not in answer.text + str(answer.headers) + caplog.text


def test_the_command_makes_keys_that_expire_and_records_it(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], database: Database
) -> None:
    monkeypatch.setenv("STICTION_DATABASE_URL", database.url)

    def run(*arguments: str) -> str:
        with pytest.raises(SystemExit) as ended:
            cli.main(["keys", *arguments])
        assert not ended.value.code
        return capsys.readouterr().out

    made = json.loads(run("create", "guest", "--expires", "30d", "--group", "lab 1", "--json"))
    shown = json.loads(run("list", "--json"))["keys"][0]
    assert (shown["group"], shown["expires_at"]) == ("lab 1", made["expires_at"])
    run("revoke", made["id"])
    with database.read() as session:
        revoked, created = audit.list_all(session, NEWEST, AuditFilter(subject=made["id"]))
        stored = access_keys.get(session, made["id"])
    assert stored.expires_at is not None
    assert abs(stored.expires_at - stored.created_at - timedelta(days=30)) < timedelta(minutes=1)
    assert (created.action, revoked.action) == ("key.created", "key.revoked")
    assert created.actor.name.startswith("command:")
    assert made["key"].rpartition("_")[2] not in str(created)


@pytest.mark.parametrize(
    "text", ["", "d", "0d", "-1d", "soon", "2020-01-31", "9999999d", "1w", "2027-13-01", "9999-12-31T23:00-14:00"]
)
def test_a_moment_that_is_none_or_past_is_refused(text: str) -> None:
    with pytest.raises(Exception, match=r"expires is .*; allowed: "):
        moment_to_come("expires", text, now())


def test_a_date_is_its_beginning_in_utc() -> None:
    assert moment_to_come("expires", "2999-01-31", now()).isoformat() == "2999-01-31T00:00:00+00:00"


def test_nothing_is_stored_for_a_key_that_is_revoked_while_the_upload_comes(
    reach: Reach, make: Make, database: Database, content: bytes
) -> None:
    text = make("upload")

    async def parts() -> AsyncIterator[bytes]:
        yield content[:100]
        with database.write() as session:
            access_keys.revoke(session, str(keys.key_id(text)))
        yield content[100:]

    headers = {"Content-Type": "application/vnd.stiction.grasp-log+npz"}
    answer = reach(key=text).request("POST", "/v1/grasp-logs", content=parts(), headers=headers)
    assert (answer.status_code, answer.json()["type"]) == (401, "/problems/invalid-key")
    assert 'error="invalid_token"' in answer.headers["www-authenticate"]
    with database.read() as session:
        assert not grasp_logs.list_all(session, Window("created_at", descending=True), LogFilter())


@pytest.mark.parametrize(
    ("method", "path", "body"),
    [
        ("PATCH", "/v1/materials/paper", {"description": "mine"}),
        ("POST", "/v1/materials", {"name": "card"}),
        ("POST", "/v1/materials/paper/fits", {"method": "ols"}),
        ("POST", "/v1/materials/paper/merges", {"source": "board"}),
        ("PUT", "/v1/sensors/finger", {"young_modulus": 2e5, "poisson_ratio": 0.48, "thickness": 4e-3}),
    ],
)
def test_nothing_is_changed_by_a_key_that_is_revoked_while_the_request_comes(
    reach: Reach, make: Make, database: Database, method: str, path: str, body: dict[str, object]
) -> None:
    text, content = make("upload"), json.dumps(body).encode()
    for name in ("paper", "board"):
        assert reach(key=text).request("POST", "/v1/materials", json={"name": name}).is_success

    async def parts() -> AsyncIterator[bytes]:
        yield content[:5]
        with database.write() as session:
            access_keys.revoke(session, str(keys.key_id(text)))
        yield content[5:]

    headers = {"Content-Type": "application/json"}
    answer = reach(key=text).request(method, path, content=parts(), headers=headers)
    assert (answer.status_code, answer.json()["type"]) == (401, "/problems/invalid-key")
    with database.read() as session:
        made = audit.list_all(session, NEWEST, AuditFilter())
    assert [entry.action for entry in made] == ["material.created"] * 2


@pytest.mark.parametrize("expires", [True, False], ids=["expires", "is revoked"])
def test_who_waits_for_a_job_is_told_nothing_once_the_key_has_ended(
    reach: Reach, make: Make, content: bytes, database: Database, expires: bool
) -> None:
    headers = {"content-type": "application/vnd.stiction.grasp-log+npz"}
    job = reach("open").request("POST", "/v1/grasp-logs", content=content, headers=headers).json()["job"]["id"]
    key = make(expires_at=now() + timedelta(seconds=1.5) if expires else None)
    client, began = reach(key=key), time.monotonic()

    def revoke() -> None:
        with database.write() as session:
            access_keys.revoke(session, str(keys.key_id(key)))

    ending = threading.Timer(0.5, (lambda: None) if expires else revoke)
    ending.start()
    answer = client.get(f"/v1/jobs/{job}?wait=10")
    ending.join()
    assert (answer.status_code, answer.json()["type"]) == (401, "/problems/invalid-key")
    assert time.monotonic() - began < 8.0


def test_wrong_keys_of_one_address_are_looked_up_two_at_once(
    reach: Callable[..., Any], make: Callable[..., str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A hundred connections of them kept others waiting for fifty times as long as they would have alone."""
    looking, most, read = 0, 0, authentication._read

    def look(*about: Any) -> Any:
        nonlocal looking, most
        looking += 1
        most = max(most, looking)
        time.sleep(0.01)
        looking -= 1
        return read(*about)

    monkeypatch.setattr(authentication, "_read", look)
    text = make()
    wrong = reach("keys", key=text[:-1] + ("0" if text[-1] != "0" else "1"))

    async def ask() -> list[int]:
        answers = await asyncio.gather(*(wrong._request("GET", "/v1/materials") for _ in range(10)))
        return [answer.status_code for answer in answers]

    assert asyncio.run(ask()) == [401] * 10
    assert most == 2
