import asyncio
from collections import Counter
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path

import pytest

from db.database import Database
from db.errors import StorageUnavailable
from db.records import Job
from db.repositories import jobs, materials
from service import worker
from service.jobs import JobPool
from service.worker import Place

Do = Callable[[Place, str], None]
ATTEMPTS = 3


@pytest.fixture
def queued(database: Database) -> list[str]:
    with database.write() as session:
        material = materials.create(session, "paper", "")
        return [jobs.add(session, "fit", "ols", material_id=material.id) for _ in range(4)]


@pytest.fixture
def working(database: Database, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., None]:
    """Run a pool whose workers are threads that ``do``, while ``meanwhile`` goes on."""
    monkeypatch.setattr("service.jobs.ProcessPoolExecutor", lambda *_: ThreadPoolExecutor(1))
    monkeypatch.setattr("service.jobs.RETRY_SECONDS", 0.001)
    monkeypatch.setattr(worker, "warm_up", lambda: None)

    def run(do: Do, meanwhile: Callable[[JobPool], object], workers: int = 2) -> None:
        monkeypatch.setattr(worker, "run_job", do)

        async def live() -> None:
            pool = JobPool(
                database, Place(database.url, tmp_path), workers=workers, attempts=ATTEMPTS, shutdown_seconds=5.0
            )
            await pool.start()
            await asyncio.to_thread(meanwhile, pool)
            await pool.stop()

        asyncio.run(live())

    return run


def get(database: Database, job_id: str) -> Job:
    with database.read() as session:
        return jobs.get(session, job_id)


def finish(database: Database, job_id: str) -> None:
    with database.write() as session:
        jobs.finish(session, job_id, "done")


def until_finished(database: Database, ids: list[str]) -> Callable[[JobPool], None]:
    def wait(_: JobPool) -> None:
        for _ in range(2000):
            if all(get(database, job_id).finished_at for job_id in ids):
                return
            asyncio.run(asyncio.sleep(0.005))
        raise AssertionError("jobs do not end")

    return wait


def test_jobs_left_from_before_are_taken_up_oldest_first(
    database: Database, queued: list[str], working: Callable[..., None]
) -> None:
    with database.write() as session:
        jobs.start_stage(session, queued[0], "samples", {})
        jobs.finish(session, queued[1], "failed", reason="bug")
    begun: list[str] = []

    def do(_: Place, job_id: str) -> None:
        begun.append(job_id)
        finish(database, job_id)

    working(do, until_finished(database, queued), workers=1)
    assert begun == [queued[0], queued[2], queued[3]]
    assert get(database, queued[1]).status == "failed"


def test_a_submitted_job_is_done(database: Database, queued: list[str], working: Callable[..., None]) -> None:
    with database.write() as session:
        extra = jobs.add(session, "fit", "ols", material_id=materials.find_id(session, "paper"))
        jobs.finish(session, extra, "failed", reason="bug")
    done: list[str] = []

    def do(_: Place, job_id: str) -> None:
        done.append(job_id)
        finish(database, job_id)

    def submit(pool: JobPool) -> None:
        with database.write() as session:
            jobs.requeue(session, extra)
        pool.submit(extra)
        until_finished(database, [*queued, extra])(pool)

    working(do, submit)
    assert sorted(done) == sorted([*queued, extra])


def test_a_job_that_loses_its_worker_is_tried_again_and_then_has_failed(
    database: Database, queued: list[str], working: Callable[..., None]
) -> None:
    poison, unlucky, *fine = queued
    tries: Counter[str] = Counter()

    def do(_: Place, job_id: str) -> None:
        tries[job_id] += 1
        if job_id == poison or (job_id == unlucky and tries[job_id] == 1):
            with database.write() as session:
                jobs.start_stage(session, job_id, "slip_state", {})
            raise BrokenProcessPool("killed")
        finish(database, job_id)

    working(do, until_finished(database, queued))
    assert tries == {poison: ATTEMPTS, unlucky: 2} | dict.fromkeys(fine, 1)
    failed = get(database, poison)
    assert (failed.status, failed.deaths, failed.stage) == ("failed", ATTEMPTS, "slip_state")
    assert failed.reason == "the worker process died 3 times, at last in stage slip_state"
    assert (get(database, unlucky).status, get(database, unlucky).deaths) == ("done", 1)


def test_a_worker_that_dies_after_the_end_of_its_job_changes_nothing(
    database: Database, queued: list[str], working: Callable[..., None]
) -> None:
    def do(_: Place, job_id: str) -> None:
        finish(database, job_id)
        raise BrokenProcessPool("killed")

    working(do, until_finished(database, queued))
    assert {get(database, job_id).status for job_id in queued} == {"done"}
    assert {get(database, job_id).deaths for job_id in queued} == {0}


def test_a_job_waits_for_storage_without_losing_an_attempt(
    database: Database, queued: list[str], working: Callable[..., None]
) -> None:
    tries: Counter[str] = Counter()

    def do(_: Place, job_id: str) -> None:
        tries[job_id] += 1
        if tries[job_id] <= 2 * ATTEMPTS:
            raise StorageUnavailable("database is locked")
        finish(database, job_id)

    working(do, until_finished(database, queued))
    assert set(tries.values()) == {2 * ATTEMPTS + 1}
    assert {get(database, job_id).deaths for job_id in queued} == {0}


def test_stopping_leaves_what_has_not_begun_for_the_next_start(
    database: Database, queued: list[str], working: Callable[..., None]
) -> None:
    begun: list[str] = []

    def do(_: Place, job_id: str) -> None:
        begun.append(job_id)
        asyncio.run(asyncio.sleep(0.3))
        finish(database, job_id)

    def until_begun(_: JobPool) -> None:
        while len(begun) < 2:
            asyncio.run(asyncio.sleep(0.001))

    working(do, until_begun)
    assert sorted(begun) == sorted(queued[:2])
    assert [get(database, job_id).status for job_id in queued] == ["done", "done", "queued", "queued"]


def test_a_lane_outlives_what_a_job_throws_at_it(
    database: Database, queued: list[str], working: Callable[..., None]
) -> None:
    def do(_place: Place, job_id: str) -> None:
        if job_id == queued[0]:
            raise RuntimeError("database disk image is malformed")
        finish(database, job_id)

    working(do, until_finished(database, queued), workers=1)
    assert [get(database, job_id).status for job_id in queued] == ["failed", "done", "done", "done"]
    assert "malformed" in (get(database, queued[0]).reason or "")
