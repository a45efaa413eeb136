from collections.abc import Callable
from typing import Any

import pytest

from db.database import Database
from db.repositories import access_keys
from service.http import access

HEADERS = {"content-type": "application/vnd.stiction.grasp-log+npz"}
ONLY_SQLITE = pytest.mark.parametrize("engine_name", ["sqlite"], indirect=True)


@pytest.fixture
def key(database: Database) -> str:
    key_id, text = access.new_key()
    with database.write() as session:
        access_keys.add(session, key_id, "robot", "upload", access.digest(text))
    return text


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
    reach: Callable[..., Any], key: str, content: bytes, setting: str, status: int, kind: str
) -> None:
    client, free = reach(key=key, **{setting: 1}), reach("open", **{setting: 1})
    assert send(client, content).status_code == 202
    refused = send(client, content)
    assert (refused.status_code, refused.json()["type"]) == (status, f"/problems/{kind}")
    assert ("retry-after" in refused.headers) == (status == 429)
    assert f"STICTION_{setting.upper()}" in refused.json()["detail"]
    assert send(free, content).status_code == 200  # without a key nothing is limited


@ONLY_SQLITE
def test_fits_count_as_queued_jobs(reach: Callable[..., Any], key: str) -> None:
    client = reach(key=key, key_queued_jobs=1)
    client.request("POST", "/v1/materials", json={"name": "paper"})
    answers = [client.request("POST", "/v1/materials/paper/fits", json={"method": "ols"}) for _ in range(2)]
    assert [answer.status_code for answer in answers] == [202, 429]
