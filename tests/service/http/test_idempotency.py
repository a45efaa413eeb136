import asyncio
from collections.abc import Callable
from contextlib import closing
from datetime import timedelta
from typing import Any

import httpx
import pytest
from sqlalchemy import func, select

from db.blobs import BlobStore
from db.database import Database
from db.records import NewGraspLog
from db.repositories import access_keys, grasp_logs, jobs, materials
from db.tables import GraspLogRow, IdempotencyKeyRow, JobRow, MaterialRow
from service.domain.access import keys
from service.http.idempotency import IdempotencyKey, RepeatableResponse, respond_once
from service.http.middleware import authentication
from tests.forking import Context

Reach = Callable[..., Any]
NPZ = {"Content-Type": "application/vnd.stiction.grasp-log+npz"}


def send(client: Any, path: str, key: str | None = "k", **more: Any) -> httpx.Response:
    headers = more.pop("headers", {}) | ({"Idempotency-Key": key} if key is not None else {})
    answer: httpx.Response = client.request("POST", path, headers=headers, **more)
    return answer


def count(database: Database, table: Any) -> int:
    with database.read() as session:
        return session.scalar(select(func.count()).select_from(table)) or 0


@pytest.fixture
def client(reach: Reach) -> Any:
    return reach("open")


def test_a_fit_is_queued_once_under_one_key(client: Any, database: Database) -> None:
    made = send(client, "/v1/materials", json={"name": "paper"})
    again = send(client, "/v1/materials", json={"name": "paper"})
    assert (again.status_code, again.content) == (made.status_code, made.content) == (201, made.content)
    assert again.headers["location"] == "/v1/materials/paper"
    asked = [send(client, "/v1/materials/paper/fits", "f", json={"seed": 1}) for _ in range(3)]
    assert {(answer.status_code, answer.content, answer.headers["location"]) for answer in asked} == {
        (202, asked[0].content, f"/v1/jobs/{asked[0].json()['id']}")
    }
    assert count(database, JobRow) == 1
    send(client, "/v1/materials/paper/fits", None, json={"seed": 1})
    assert count(database, JobRow) == 2


@pytest.mark.parametrize(
    ("path", "more"),
    [
        ("/v1/materials", {"json": {"name": "steel"}}),
        ("/v1/materials/paper/fits", {"json": {}}),
        ("/v1/grasp-logs", {"content": b"no log", "headers": NPZ}),
    ],
)
def test_a_key_stands_for_one_request(client: Any, database: Database, path: str, more: Any, content: bytes) -> None:
    send(client, "/v1/materials", json={"name": "paper"})
    if "content" in more:
        more = more | {"content": content}
    refused = send(client, path, **more)
    assert (refused.status_code, refused.json()["type"]) == (422, "/problems/idempotency-key-reused")
    assert refused.json()["value"] == "k"
    assert (count(database, MaterialRow), count(database, JobRow), count(database, GraspLogRow)) == (1, 0, 0)


def test_a_key_stands_for_one_request_with_its_parameters(client: Any, content: bytes) -> None:
    more = {"content": content, "headers": NPZ}
    assert send(client, "/v1/grasp-logs", **more).status_code == 202
    refused = send(client, "/v1/grasp-logs?detector=strain_rate", **more)
    assert (refused.status_code, refused.json()["type"]) == (422, "/problems/idempotency-key-reused")


def test_an_upload_is_answered_again_whatever_has_become_of_its_materials_name(client: Any, content: bytes) -> None:
    send(client, "/v1/materials", None, json={"name": "paper"})
    client.request("PUT", "/v1/materials/paper/aliases/A4").raise_for_status()
    upload = {"content": content, "headers": NPZ}
    first = send(client, "/v1/grasp-logs?material=A4", **upload)
    client.request("DELETE", "/v1/materials/paper/aliases/A4").raise_for_status()
    assert send(client, "/v1/grasp-logs?material=A4", "another", **upload).status_code == 404
    again = send(client, "/v1/grasp-logs?material=A4", **upload)
    assert (first.status_code, again.status_code, again.content) == (202, 202, first.content)
    assert again.headers["location"] == first.headers["location"]
    refused = send(client, "/v1/grasp-logs?material=A4", content=b"another", headers=NPZ)
    assert refused.json()["type"] == "/problems/idempotency-key-reused"


def test_what_was_refused_may_be_mended_under_its_key(client: Any, database: Database) -> None:
    assert send(client, "/v1/materials/paper/fits", json={}).status_code == 404
    assert count(database, IdempotencyKeyRow) == 0
    assert send(client, "/v1/materials", json={"name": "paper"}).status_code == 201


def test_an_upload_of_what_is_stored_already_keeps_nothing(client: Any, database: Database, content: bytes) -> None:
    """Each kept its answer for a day: 4 GB of them, which no quota counted, by one small log sent again and again."""
    upload = {"content": content, "headers": NPZ}
    first = send(client, "/v1/grasp-logs", "a", **upload)
    for _ in range(2):
        again = send(client, "/v1/grasp-logs", "b", **upload)
        assert (again.status_code, again.json()["id"]) == (200, first.json()["id"])
    assert (send(client, "/v1/grasp-logs", "a", **upload).content, count(database, IdempotencyKeyRow)) == (
        first.content,
        1,
    )


def test_what_is_done_again_for_a_stored_log_is_done_once_under_its_key(client: Any, content: bytes) -> None:
    """A late repetition set its sensor back, which somebody had changed since."""
    upload, path = {"content": content, "headers": NPZ}, "/v1/grasp-logs?sensor="
    log = send(client, f"{path}left", None, **upload).json()["id"]
    first = send(client, f"{path}right", "b", **upload)
    assert (first.status_code, first.json()["sensor"]) == (200, "right")
    assert send(client, f"{path}left", "c", **upload).json()["sensor"] == "left"
    again = send(client, f"{path}right", "b", **upload)
    assert (again.status_code, again.content) == (200, first.content)
    assert client.get(f"/v1/grasp-logs/{log}").json()["sensor"] == "left"
    refused = send(client, f"{path}other", "b", **upload)
    assert refused.json()["type"] == "/problems/idempotency-key-reused"


@pytest.mark.parametrize("key", ["", " ", "a b", "x" * 201, "ü".encode()])
def test_a_key_that_cannot_be_is_refused_by_name(client: Any, key: Any) -> None:
    answer = send(client, "/v1/materials", key, json={"name": "paper"})
    assert (answer.status_code, answer.json()["name"]) == (422, "Idempotency-Key")


def test_two_keys_of_one_request_are_refused_by_name(client: Any) -> None:
    headers = [("Idempotency-Key", "a"), ("Idempotency-Key", "b")]
    answer = client.request("POST", "/v1/materials", headers=headers, json={"name": "paper"})
    assert (answer.status_code, answer.json()["name"], answer.json()["value"]) == (422, "Idempotency-Key", "a, b")


def test_identical_uploads_at_once_under_one_key_get_one_answer(
    client: Any, database: Database, content: bytes
) -> None:
    async def upload_together() -> list[httpx.Response]:
        headers = NPZ | {"Idempotency-Key": "k"}
        uploads = [client._request("POST", "/v1/grasp-logs", content=content, headers=headers) for _ in range(4)]
        return await asyncio.gather(*uploads)

    answers = asyncio.run(upload_together())
    assert {(answer.status_code, answer.content) for answer in answers} == {(202, answers[0].content)}
    assert (count(database, GraspLogRow), count(database, JobRow)) == (1, 1)
    other = send(client, "/v1/grasp-logs?detector=strain_rate", content=content, headers=NPZ)
    assert other.json()["type"] == "/problems/idempotency-key-reused"
    assert count(database, GraspLogRow) == 1


def store(url: str, together: Any, key: IdempotencyKey | None, answers: Any) -> None:
    """One process of several that store the same log at once."""
    with closing(Database(url)) as database:
        together.wait()
        with database.write() as session:
            answers.put(respond_once(session, key, lambda: add(session)))


def add(session: Any) -> RepeatableResponse:
    log = NewGraspLog("0" * 64, 10, "npz", "filter", materials.find_id(session, "paper"), "sensor", 9, 0.3, (8, 8))
    log_id = grasp_logs.add(session, log)
    job = jobs.add(session, "ingest", "ols", material_id=log.material_id, grasp_log_id=log_id)
    return RepeatableResponse(202, f"/v1/grasp-logs/{log_id}", {"job": job})


def test_processes_that_ask_the_same_at_once_do_it_once(database: Database, blobs: BlobStore) -> None:
    assert blobs  # the database's folder
    with database.write() as session:
        materials.create(session, "paper", "")
    context = Context()
    together, answers = context.Barrier(3), context.Queue()
    key = IdempotencyKey("", "k", timedelta(hours=1), "0" * 64)
    processes = [context.Process(target=store, args=(database.url, together, key, answers)) for _ in range(3)]
    for process in processes:
        process.start()
    given = [answers.get(timeout=60) for _ in processes]
    for process in processes:
        process.join()
    assert given[0] == given[1] == given[2]
    assert (count(database, GraspLogRow), count(database, JobRow)) == (1, 1)


@pytest.mark.parametrize("engine_name", ["sqlite"], indirect=True)
def test_what_was_answered_is_no_answer_to_a_key_that_was_revoked_since(
    reach: Reach, make: Callable[..., str], database: Database, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(authentication, "KEPT_SECONDS", -1.0)
    text = make("upload")
    client = reach(key=text)
    made, again = [send(client, "/v1/materials", json={"name": "paper"}) for _ in range(2)]
    assert (made.status_code, again.status_code, again.content) == (201, 201, made.content)
    with database.write() as session:
        access_keys.revoke(session, keys.key_id(text) or "")
    refused = send(client, "/v1/materials", json={"name": "paper"})
    assert (refused.status_code, refused.json()["type"]) == (401, "/problems/invalid-key")
