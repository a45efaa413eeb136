import asyncio
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from threading import Barrier, BrokenBarrierError
from typing import Any

import numpy as np
import pytest

from db.blobs import BlobStore
from db.database import Database
from db.repositories import access_keys, usage
from service.domain.access import keys
from service.domain.access.principal import Principal
from service.domain.errors import DomainError
from service.domain.materials import curate, ownership
from service.domain.uploads import upload
from service.formats.reading import Description

HEADERS = {"content-type": "application/vnd.stiction.grasp-log+npz"}
ONLY_SQLITE = pytest.mark.parametrize("engine_name", ["sqlite"], indirect=True)


@pytest.fixture
def key(database: Database) -> str:
    key_id, text = keys.new_key()
    with database.write() as session:
        access_keys.add(session, key_id, "robot", "upload", keys.digest(text))
    return text


@pytest.fixture
def contents(members: dict[str, Any], repack: Callable[..., bytes]) -> list[bytes]:
    """Two logs that differ."""
    return [repack(members | {"sensor": np.str_(f"finger {number}")}) for number in range(2)]


def send(client: Any, content: bytes) -> Any:
    return client.request("POST", "/v1/grasp-logs", content=content, headers={**client.headers, **HEADERS})


@ONLY_SQLITE
@pytest.mark.parametrize(
    ("setting", "status", "kind"),
    [
        ("key_queued_jobs", 429, "quota-exceeded"),
        ("key_logs_a_day", 429, "quota-exceeded"),
        ("key_stored_bytes", 507, "storage-quota-exceeded"),
    ],
)
def test_a_key_that_has_its_quota_stores_no_more(
    reach: Callable[..., Any],
    key: str,
    contents: list[bytes],
    blobs: BlobStore,
    setting: str,
    status: int,
    kind: str,
) -> None:
    client, free = reach(key=key, **{setting: 1}), reach("open", **{setting: 1})
    assert send(client, contents[0]).status_code == 202
    refused = send(client, contents[1])
    assert (refused.status_code, refused.json()["type"]) == (status, f"/problems/{kind}")
    assert ("retry-after" in refused.headers) == (status == 429)
    assert f"STICTION_{setting.upper()}" in refused.json()["detail"]
    assert len(list(blobs.hashes())) == 1  # nothing is kept of what is refused
    assert send(free, contents[1]).status_code == 202  # without a key nothing is limited


@ONLY_SQLITE
@pytest.mark.parametrize("setting", ["key_queued_jobs", "key_logs_a_day", "key_stored_bytes"])
def test_a_known_log_takes_nothing_of_a_quota_while_its_file_is_there(
    reach: Callable[..., Any], key: str, contents: list[bytes], database: Database, setting: str
) -> None:
    client = reach(key=key, **{setting: 1})
    first = send(client, contents[0]).json()
    again = send(client, contents[0])
    assert (again.status_code, again.json()["id"]) == (200, first["id"])
    with database.write() as session:
        session.connection().exec_driver_sql("UPDATE grasp_logs SET file_state = 'gone'")
    assert (send(client, contents[0]).status_code == 200) == (setting == "key_stored_bytes")


@ONLY_SQLITE
def test_a_known_log_whose_job_is_queued_anew_keeps_to_the_quota(
    reach: Callable[..., Any], key: str, contents: list[bytes]
) -> None:
    client = reach(key=key, key_queued_jobs=1)
    job = send(client, contents[0]).json()["job"]["id"]
    reach("open").request("POST", f"/v1/jobs/{job}/cancel").raise_for_status()
    assert send(client, contents[1]).status_code == 202
    assert send(client, contents[0]).status_code == 429


@ONLY_SQLITE
def test_fits_count_as_queued_jobs(reach: Callable[..., Any], key: str) -> None:
    client = reach(key=key, key_queued_jobs=1)
    client.request("POST", "/v1/materials", json={"name": "paper"})
    answers = [client.request("POST", "/v1/materials/paper/fits", json={"method": "ols"}) for _ in range(2)]
    assert [answer.status_code for answer in answers] == [202, 429]


@pytest.fixture
def counting_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two requests that count what a key has wait for each other, so that neither sees what the other stores."""
    both, count = Barrier(2), usage.queued_jobs

    def count_together(*given: Any) -> int:
        found = count(*given)
        with suppress(BrokenBarrierError):  # the other one waits until this one has stored
            both.wait(timeout=0.5)
        return found

    monkeypatch.setattr(usage, "queued_jobs", count_together)


@pytest.mark.usefixtures("counting_at_once")
def test_uploads_at_the_same_time_do_not_pass_a_quota_together(
    reach: Callable[..., Any], key: str, contents: list[bytes]
) -> None:
    clients = [reach(key=key, key_queued_jobs=1) for _ in range(2)]
    with ThreadPoolExecutor(2) as pool:
        answers = list(pool.map(send, clients, contents))
    assert sorted(answer.status_code for answer in answers) == [202, 429]


@pytest.mark.usefixtures("counting_at_once")
def test_fits_at_the_same_time_do_not_pass_a_quota_together(reach: Callable[..., Any], key: str) -> None:
    clients = [reach(key=key, key_queued_jobs=1) for _ in range(2)]
    clients[0].request("POST", "/v1/materials", json={"name": "paper"})

    def ask(client: Any) -> int:
        return int(client.request("POST", "/v1/materials/paper/fits", json={"method": "ols"}).status_code)

    with ThreadPoolExecutor(2) as pool:
        assert sorted(pool.map(ask, clients)) == [202, 429]


@pytest.mark.parametrize("setting", ["key_queued_jobs", "key_logs_a_day", "key_stored_bytes"])
def test_a_log_that_a_stream_stores_keeps_to_the_quotas(
    reach: Callable[..., Any], key: str, content: bytes, setting: str
) -> None:
    client = reach(key=key, **{setting: 1})
    assert send(client, content).status_code == 202
    context, key_id = client.app.state.context, keys.key_id(key)
    found = Description("npz", "finger", 2, 1.0, (1, 1), "filter")
    with context.blobs.spool() as spool:
        spool.path.write_bytes(b"frames")
        request = upload.UploadRequest(None, None, "filter", principal=Principal(key_id=key_id))
        with pytest.raises(DomainError, match=setting.upper()):
            asyncio.run(upload.store_made(context, spool, found, request))


CHANGES: tuple[tuple[str, str, dict[str, Any] | None], ...] = (
    ("POST", "/v1/materials", {"name": "glass"}),
    ("PATCH", "/v1/materials/paper", {"description": "thin"}),
    ("PUT", "/v1/materials/paper/aliases/A4", None),
    ("PUT", "/v1/materials/paper/owners/group:lab", None),
    ("PUT", "/v1/sensors/finger", {"young_modulus": 2.5e5, "poisson_ratio": 0.48}),
    ("POST", "/v1/materials/paper/fits", {"method": "ols"}),
)


@ONLY_SQLITE
@pytest.mark.parametrize(
    ("method", "path", "body"), CHANGES, ids=["material", "description", "alias", "owner", "sensor", "fit"]
)
def test_a_key_that_has_changed_as_much_as_it_may_changes_no_more(
    reach: Callable[..., Any], key: str, method: str, path: str, body: dict[str, Any] | None
) -> None:
    bounded, free = reach(key=key, key_changes_a_day=1), reach("open", key_changes_a_day=1)
    assert bounded.request("POST", "/v1/materials", json={"name": "paper"}).status_code == 201
    more: dict[str, Any] = {} if body is None else {"json": body}
    refused = bounded.request(method, path, **more)
    assert (refused.status_code, refused.json()["type"]) == (429, "/problems/quota-exceeded")
    assert "STICTION_KEY_CHANGES_A_DAY" in refused.json()["detail"]
    assert "retry-after" in refused.headers
    assert free.request(method, path, **more).is_success


@ONLY_SQLITE
def test_another_sensor_of_a_stored_log_counts_as_a_change(
    reach: Callable[..., Any], key: str, contents: list[bytes]
) -> None:
    client = reach(key=key, key_changes_a_day=2)
    client.headers.update(HEADERS)

    def send_of(sensor: str) -> Any:
        return client.request("POST", "/v1/grasp-logs", params={"sensor": sensor}, content=contents[0])

    answers = [send_of(sensor) for sensor in ("left", "right", "middle", "another", "middle")]
    assert [answer.status_code for answer in answers] == [202, 200, 200, 429, 200]  # the last one is its sensor already
    assert "STICTION_KEY_CHANGES_A_DAY" in answers[3].json()["detail"]
    assert {each["name"] for each in client.get("/v1/sensors").json()["items"]} <= {"left", "right", "middle"}
    changed = reach("open").get("/v1/audit?action=grasp_log.sensor_changed").json()["items"]
    assert [(each["details"]["sensor_before"], each["details"]["sensor"]) for each in changed] == [
        ("right", "middle"),
        ("left", "right"),
    ]


@ONLY_SQLITE
@pytest.mark.parametrize(("method", "body"), [("PUT", {"reason": "torn"}), ("DELETE", None)], ids=["reason", "restore"])
def test_a_withdrawal_counts_and_is_never_refused_but_no_more_is_done_with_it(
    reach: Callable[..., Any], key: str, contents: list[bytes], method: str, body: dict[str, str] | None
) -> None:
    client = reach(key=key, key_changes_a_day=1)
    client.request("POST", "/v1/materials", json={"name": "paper"}).raise_for_status()
    headers = {**client.headers, **HEADERS}
    sent = client.request("POST", "/v1/grasp-logs?material=paper", content=contents[0], headers=headers)
    path = f"/v1/grasp-logs/{sent.raise_for_status().json()['id']}/withdrawal"
    for _ in range(2):  # once more it changes nothing
        withdrawn = client.request("PUT", path, json={"reason": "wet"})
    refused = client.request(method, path, json=body)
    assert (refused.status_code, refused.json()["type"]) == (429, "/problems/quota-exceeded")
    told = client.get(path.removesuffix("/withdrawal")).json()["withdrawal"]
    assert told == withdrawn.raise_for_status().json()["grasp_log"]["withdrawal"]


@ONLY_SQLITE
@pytest.mark.parametrize("path", ["/v1/grasp-logs/none/withdrawal", "/v1/materials/none/epochs"])
def test_a_reason_has_a_bounded_length(reach: Callable[..., Any], path: str) -> None:
    client, method = reach("open"), "PUT" if "logs" in path else "POST"
    assert client.request(method, path, json={"reason": "a" * 1000}).status_code == 404
    assert client.request(method, path, json={"reason": "a" * 1001}).status_code == 422


@ONLY_SQLITE
def test_a_material_has_a_bounded_number_of_owners(reach: Callable[..., Any], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ownership, "MOST_OWNERS", 2)
    client = reach("open")
    client.request("POST", "/v1/materials", json={"name": "paper"}).raise_for_status()
    for owner in ("group:a", "group:b", "group:b"):  # once more it is known
        client.request("PUT", f"/v1/materials/paper/owners/{owner}").raise_for_status()
    refused = client.request("PUT", "/v1/materials/paper/owners/group:c")
    assert (refused.status_code, refused.json()["name"], refused.json()["allowed"][:9]) == (422, "owners", "at most 2")
    assert client.get("/v1/materials/paper/owners").json()["owners"] == ["group:a", "group:b"]


@ONLY_SQLITE
def test_a_material_has_a_bounded_number_of_aliases(reach: Callable[..., Any], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(curate, "MOST_ALIASES", 2)
    client = reach("open")
    for name in ("paper", "glass"):
        client.request("POST", "/v1/materials", json={"name": name}).raise_for_status()
        client.request("PUT", f"/v1/materials/{name}/aliases/{name} 2").raise_for_status()
    for _ in range(2):  # once more it is known
        client.request("PUT", "/v1/materials/paper/aliases/A4").raise_for_status()
    for method, path, body in (
        ("PUT", "/v1/materials/paper/aliases/A5", None),
        ("PATCH", "/v1/materials/paper", {"name": "card"}),
        ("POST", "/v1/materials/paper/merges", {"source": "glass"}),
    ):
        refused = client.request(method, path, json=body)
        assert (refused.status_code, refused.json()["name"]) == (422, "aliases")
        assert refused.json()["allowed"].startswith("at most 2")
    assert client.get("/v1/materials/paper").json()["aliases"] == ["A4", "paper 2"]
    client.request("PATCH", "/v1/materials/paper", json={"name": "A4"}).raise_for_status()  # as many as before
