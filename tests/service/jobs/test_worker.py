from collections.abc import Callable
from pathlib import Path

import pytest

from db.database import Database
from db.errors import ClaimLost, StorageUnavailable
from db.records import Claim
from db.repositories import jobs, materials
from service.jobs import pipeline, worker
from service.jobs.worker import StoreConfig


@pytest.fixture
def mine(database: Database, claim: Callable[[], Claim]) -> Claim:
    with database.write() as session:
        material = materials.create(session, "paper", "")
        jobs.add(session, "fit", "ols", material_id=material.id)
    return claim()


def run(database: Database, tmp_path: Path, claim: Claim) -> None:
    config = StoreConfig(database.url, tmp_path)
    worker.run_job(config, claim)


def test_a_defect_ends_the_job_with_its_name(
    database: Database, tmp_path: Path, mine: Claim, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object) -> None:
        raise ZeroDivisionError("in the numerics")

    monkeypatch.setattr(pipeline, "run_job", fail)
    run(database, tmp_path, mine)
    with database.read() as session:
        job = jobs.get(session, mine.job_id)
    assert (job.status, job.reason) == ("failed", "ZeroDivisionError: in the numerics")


def test_storage_that_cannot_be_used_is_for_the_server_to_wait_for(
    database: Database, tmp_path: Path, mine: Claim, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object) -> None:
        raise StorageUnavailable("database is locked")

    monkeypatch.setattr(pipeline, "run_job", fail)
    with pytest.raises(StorageUnavailable):
        run(database, tmp_path, mine)
    with database.read() as session:
        assert jobs.get(session, mine.job_id).status == "running"


def test_a_job_runs_to_its_end(database: Database, tmp_path: Path, mine: Claim) -> None:
    run(database, tmp_path, mine)
    with database.read() as session:
        assert jobs.get(session, mine.job_id).status == "refused"


def test_a_job_that_was_cancelled_stores_no_end(
    database: Database, tmp_path: Path, mine: Claim, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object) -> None:
        with database.write() as session:
            jobs.cancel(session, mine.job_id, "no longer wanted")
        raise ZeroDivisionError

    for step in (fail, pipeline.run_job):
        monkeypatch.setattr(pipeline, "run_job", step)
        run(database, tmp_path, mine)
        with database.read() as session:
            assert jobs.get(session, mine.job_id).reason == "no longer wanted"


def test_what_another_runner_has_taken_over_is_left_to_it(
    database: Database, tmp_path: Path, mine: Claim, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    def lose(*_: object) -> None:
        raise ClaimLost(mine.job_id)

    monkeypatch.setattr(pipeline, "run_job", lose)
    run(database, tmp_path, mine)
    assert caplog.messages == [f"{ClaimLost(mine.job_id)}; what was done of it stays"]
    with database.read() as session:
        assert jobs.get(session, mine.job_id).status == "running"


def test_warming_up_tries_what_a_job_needs(caplog: pytest.LogCaptureFixture) -> None:
    worker.warm_up.cache_clear()
    worker.warm_up()
    assert caplog.records == []
