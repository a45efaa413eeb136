"""A disk that forgets: a bit of a stored file is not what it was. It is an error with a name, never another result."""

import asyncio
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from sqlalchemy import select

from db.blobs import BlobStore
from db.database import Database
from db.records import Claim
from db.repositories import jobs
from db.tables import AuditEntryRow
from service.jobs import scrub, worker
from service.jobs.scrub import Scrub
from service.jobs.worker import StoreConfig

NPZ = {"content-type": "application/vnd.stiction.grasp-log+npz"}
DAMAGED = (500, "/problems/file-damaged")


def flip(path: Path) -> None:
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)


def entries(database: Database) -> list[tuple[str, str]]:
    """What was damaged, and what found it."""
    with database.read() as session:
        rows = session.scalars(select(AuditEntryRow).where(AuditEntryRow.action == "blob.damaged"))
        return [(row.subject, row.details["by"]) for row in rows]


@pytest.fixture
def caller(reach: Callable[..., Any]) -> Any:
    caller = reach("open")
    caller.request("POST", "/v1/materials", json={"name": "paper"})
    return caller


@pytest.fixture
def log(caller: Any, content: bytes) -> dict[str, Any]:
    answer = caller.request("POST", "/v1/grasp-logs", params={"material": "paper"}, content=content, headers=NPZ)
    stored: dict[str, Any] = answer.raise_for_status().json()
    return stored


def test_a_download_of_a_damaged_file_is_refused_and_recorded_once(
    caller: Any, log: dict[str, Any], database: Database, blobs: BlobStore, content: bytes
) -> None:
    flip(blobs.path(log["sha256"]))
    for name in ("npz", "npz", "parquet"):
        answer = caller.get(f"/v1/grasp-logs/{log['id']}/file", params={"format": name})
        assert (answer.status_code, answer.json()["type"]) == DAMAGED
        assert log["sha256"] in answer.json()["detail"]
    assert entries(database) == [(log["sha256"], f"GET /v1/grasp-logs/{log['id']}/file")]
    assert "stiction_damaged_files 1.0" in caller.get("/metrics").text
    caller.request("POST", "/v1/grasp-logs", params={"material": "paper"}, content=content, headers=NPZ)
    assert caller.get(f"/v1/grasp-logs/{log['id']}/file").content == content  # mended by the same upload


def test_a_job_on_a_damaged_file_fails_by_name(
    caller: Any, log: dict[str, Any], database: Database, blobs: BlobStore, claim: Callable[[], Claim], tmp_path: Path
) -> None:
    flip(blobs.path(log["sha256"]))
    worker.run_job(StoreConfig(database.url, tmp_path), claim())
    job = caller.get(f"/v1/jobs/{log['job']['id']}").json()
    assert (job["status"], job["stage"]) == ("failed", "frames")
    assert f"blob {log['sha256']} has other bytes than it had" in job["reason"]
    assert entries(database) == [(log["sha256"], f"job {job['id']}")]


def test_results_and_fits_of_damaged_files_are_refused(
    caller: Any, log: dict[str, Any], database: Database, blobs: BlobStore, claim: Callable[[], Claim], tmp_path: Path
) -> None:
    config = StoreConfig(database.url, tmp_path)
    worker.run_job(config, claim())
    for sha256 in set(blobs.hashes()) - {log["sha256"]}:
        flip(blobs.path(sha256))
    for result in ("stick-ratio", "events", "samples"):
        answer = caller.get(f"/v1/grasp-logs/{log['id']}/{result}")
        assert (answer.status_code, answer.json()["type"]) == DAMAGED
    fit = caller.request("POST", "/v1/materials/paper/fits", json={"method": "robust"}).json()
    worker.run_job(config, claim())
    with database.read() as session:
        job = jobs.get(session, fit["id"])
    assert job.status == "failed"
    assert "has other bytes than it had" in str(job.reason)


def test_a_scrub_finds_what_nobody_asks_for_at_its_pace(
    log: dict[str, Any], database: Database, blobs: BlobStore, content: bytes
) -> None:
    flip(blobs.path(log["sha256"]))
    for number in range(3):
        blobs.put(bytes([number]) * 1000)
    seconds = 0.2
    paced = Scrub(database, blobs, (len(content) + 3000) / seconds, lambda: True)
    begin = time.monotonic()
    paced.read_all()
    assert time.monotonic() - begin >= seconds
    assert (paced.bytes, paced.passes) == (len(content) + 3000, 1)
    assert entries(database) == [(log["sha256"], "scrub")]


def test_only_the_process_that_leads_scrubs_and_only_if_it_is_to(
    database: Database, blobs: BlobStore, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(scrub, "REST_SECONDS", 0.001)
    blobs.put(b"tactile")
    leads = [False]
    other = Scrub(database, blobs, 1e6, lambda: leads[0])
    off = Scrub(database, blobs, 0.0, lambda: True)
    other.start()
    off.start()
    time.sleep(0.05)
    assert (other.passes, off.passes) == (0, 0)
    leads[0] = True
    while not other.passes:
        time.sleep(0.001)
    asyncio.run(other.stop())
    assert off.passes == 0
