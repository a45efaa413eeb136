import time
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import pytest
from fastapi import Request
from sqlalchemy import event

from db.database import Database
from db.paging import Window
from db.repositories import jobs
from service.domain.materials import curate
from service.domain.models import model_cache
from service.http.conditional import conditional, is_one_of, tagged

PATHS = ("/v1/materials/paper", "/v1/materials/paper/friction?fn=0.05")


def version(client: Any) -> int:
    return int(client.get(PATHS[1]).json()["version"])


@pytest.mark.usefixtures("store")
@pytest.mark.parametrize("path", PATHS)
def test_what_has_not_changed_is_not_sent_again(reach: Any, path: str, store: Callable[[], None]) -> None:
    client = reach("open")
    first = client.get(path)
    tag = first.headers["etag"]
    assert first.headers["cache-control"] == "private, no-cache"
    for sent in (tag, f"W/{tag}", f'"other", {tag}', "*"):
        again = client.get(path, headers={"If-None-Match": sent})
        assert (again.status_code, again.content, again.headers["etag"]) == (304, b"", tag)
    for sent in ('"other"', tag.strip('"'), "", "a," * 600 + tag):
        assert client.get(path, headers={"If-None-Match": sent}).content == first.content
    store()
    new = client.get(path, headers={"If-None-Match": tag})
    assert (new.status_code, new.headers["etag"] == tag) == (200, False)


@pytest.mark.usefixtures("store")
def test_a_material_is_changed_only_where_it_is_as_it_was_read(reach: Any) -> None:
    """Who renamed or described what another had just changed did so unseen."""
    client = reach("open")

    def change(description: str, if_match: str) -> tuple[int, str]:
        answer = client.request("PATCH", PATHS[0], json={"description": description}, headers={"If-Match": if_match})
        assert answer.status_code == 200 or answer.json()["type"] == "/problems/precondition-failed"
        return answer.status_code, client.get(PATHS[0]).json()["description"]

    first = client.get(PATHS[0]).headers["etag"]
    assert change("a", f'"other", {first}') == (200, "a")
    for stale in (first, '"other"', "", f"W/{client.get(PATHS[0]).headers['etag']}"):
        assert change("b", stale) == (412, "a")
    assert change("c", client.get(PATHS[0]).headers["etag"]) == (200, "c")
    assert change("d", "*") == (200, "d")
    changed = client.request("PATCH", PATHS[0], json={"description": "e"})
    assert changed.headers["etag"] == client.get(PATHS[0]).headers["etag"]
    assert change("f", changed.headers["etag"]) == (200, "f")


@pytest.mark.usefixtures("store")
def test_a_tag_stands_for_one_material_and_its_name(reach: Any) -> None:
    client = reach("open")
    tag = client.get(PATHS[1]).headers["etag"]
    client.request("PATCH", PATHS[0], json={"name": "steel"})
    renamed = client.get(PATHS[1], headers={"If-None-Match": tag})
    assert renamed.json()["material"] == "steel"


@pytest.mark.usefixtures("store")
def test_a_look_up_asks_the_database_once_in_a_while(
    reach: Any, database: Database, store: Callable[[], None], monkeypatch: pytest.MonkeyPatch
) -> None:
    client, seen = reach("open", lookup_seconds=60.0), list[str]()
    event.listen(database.engine, "before_cursor_execute", lambda *given: seen.append(given[2]))
    assert [version(client) for _ in range(3)] == [1, 1, 1]
    assert len([statement for statement in seen if "friction_models" in statement]) == 1
    store()
    assert version(client) == 1
    monkeypatch.setattr(model_cache, "time", SimpleNamespace(monotonic=lambda: time.monotonic() + 61.0))
    assert version(client) == 2


@pytest.mark.usefixtures("store")
@pytest.mark.parametrize("path", ["/v1/jobs/{job}", "/v1/materials/paper", "/v1/materials/paper/fits"])
def test_who_has_seen_a_new_model_looks_it_up_at_once(
    reach: Any, database: Database, store: Callable[[], None], path: str
) -> None:
    client = reach("open", lookup_seconds=60.0)
    assert version(client) == 1
    store()
    with database.write() as session:
        job = jobs.list_all(session, Window("created_at", descending=True), "queued")[0].id
        jobs.cancel(session, job, "ended, however it did")
    assert version(client) == 1
    assert client.get(path.format(job=job)).status_code == 200
    assert version(client) == 2


@pytest.mark.usefixtures("store")
def test_a_name_that_is_freed_or_changed_is_forgotten(reach: Any) -> None:
    client = reach("open", lookup_seconds=60.0)
    context = client.app.state.context
    assert version(client) == 1
    curate.change(context, "paper", "steel", None)
    assert client.get(PATHS[1]).json()["material"] == "steel"
    curate.remove_alias(context, "steel", "paper")
    assert client.get(PATHS[1]).json()["type"] == "/problems/unknown-material"


@pytest.mark.parametrize("engine_name", ["sqlite"], indirect=True)
def test_the_file_of_a_log_is_not_sent_to_who_has_it(reach: Callable[..., Any], content: bytes) -> None:
    lab = reach("open")
    headers = {"content-type": "application/vnd.stiction.grasp-log+npz"}
    log = lab.request("POST", "/v1/grasp-logs", content=content, headers=headers).json()
    path = f"/v1/grasp-logs/{log['id']}/file"
    first = lab.get(path)
    assert (first.content, first.headers["etag"]) == (content, f'"{log["sha256"]}"')
    for listed in (first.headers["etag"], f'"x", W/{first.headers["etag"]}', "*"):
        again = lab.get(path, headers={"If-None-Match": listed})
        assert (again.status_code, again.content, again.headers["etag"]) == (304, b"", first.headers["etag"])
    assert lab.get(path, headers={"If-None-Match": '"x"'}).content == content
    part = lab.get(path, headers={"Range": "bytes=0-9", "If-Range": first.headers["etag"]})
    assert (part.status_code, part.content) == (206, content[:10])


TAG = '"a1"'


@pytest.mark.parametrize(
    ("listed", "is_known"),
    [
        (TAG, True),
        (f"W/{TAG}", True),
        (f'"b", {TAG} ,"c"', True),
        ("*", True),
        ("", False),
        ("a1", False),
        ('"a1', False),
        ('"a11"', False),
        (f"w/{TAG}", False),
        (TAG.ljust(1024), True),
        (TAG.ljust(1025), False),
    ],
)
def test_a_client_has_what_its_list_of_tags_names(listed: str, is_known: bool) -> None:
    assert is_one_of(TAG, listed) is is_known
    made = list[str]()

    def body() -> str:
        made.append("made")
        return "{}"

    headers = [(b"if-none-match", listed.encode())]
    answer = conditional(Request({"type": "http", "headers": headers}), TAG, body)
    assert (answer.status_code, bytes(answer.body)) == ((304, b"") if is_known else (200, b"{}"))
    assert (answer.headers["etag"], answer.headers["cache-control"]) == (TAG, "private, no-cache")
    assert len(made) == (not is_known)


def test_a_body_without_a_version_has_its_hash_for_a_tag() -> None:
    answers = [tagged(Request({"type": "http", "headers": []}), body) for body in ("{}", "{}", "[]")]
    first, second, other = (answer.headers["etag"] for answer in answers)
    assert first == second != other
    assert len(first) == 2 + 24
    again = tagged(Request({"type": "http", "headers": [(b"if-none-match", first.encode())]}), "{}")
    assert (again.status_code, answers[0].media_type) == (304, "application/json")
