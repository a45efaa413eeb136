from pathlib import Path

import pytest

from db.blobs import BlobStore
from db.database import Database
from db.errors import StorageUnavailable
from db.repositories import jobs, materials
from service import pipeline, worker
from service.worker import Place


@pytest.fixture
def job_id(database: Database) -> str:
    with database.write() as session:
        material = materials.create(session, "paper", "")
        return jobs.add(session, "fit", "ols", material_id=material.id)


def run(database: Database, tmp_path: Path, job_id: str) -> None:
    place = Place(database.url, tmp_path)
    try:
        worker.run_job(place, job_id)
    finally:
        worker._stores(place)[0].close()
        worker._stores.cache_clear()


def test_a_defect_ends_the_job_with_its_name(
    database: Database, tmp_path: Path, job_id: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(_: Database, __: BlobStore, ___: str) -> None:
        raise ZeroDivisionError("in the numerics")

    monkeypatch.setattr(pipeline, "run_job", fail)
    run(database, tmp_path, job_id)
    with database.read() as session:
        job = jobs.get(session, job_id)
    assert (job.status, job.reason) == ("failed", "ZeroDivisionError: in the numerics")


def test_storage_that_cannot_be_used_is_for_the_server_to_wait_for(
    database: Database, tmp_path: Path, job_id: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(_: Database, __: BlobStore, ___: str) -> None:
        raise StorageUnavailable("database is locked")

    monkeypatch.setattr(pipeline, "run_job", fail)
    with pytest.raises(StorageUnavailable):
        run(database, tmp_path, job_id)
    with database.read() as session:
        assert jobs.get(session, job_id).status == "queued"


def test_a_job_runs_to_its_end(database: Database, tmp_path: Path, job_id: str) -> None:
    run(database, tmp_path, job_id)
    with database.read() as session:
        assert jobs.get(session, job_id).status == "refused"


def test_warming_up_tries_what_a_job_needs(caplog: pytest.LogCaptureFixture) -> None:
    worker.warm_up()
    assert caplog.records == []
