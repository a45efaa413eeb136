"""A job that wants too much is ended once, says where and why, and the next one is done."""

import asyncio
import resource
import time
from collections.abc import Callable
from contextlib import AbstractContextManager
from functools import partial
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest

import slipcore
from db.blobs import BlobStore
from db.database import Database
from db.records import Claim, Gel, NewGraspLog
from db.repositories import grasp_logs, jobs, runners, sensors
from db.tables import GraspLogRow
from service.jobs import find_samples, pipeline, process_executor, worker
from service.jobs.executor import LimitReached, WorkerDied
from service.processes import limits
from service.settings import Settings
from slipcore import GraspLog
from stiction_client import container

Serving = Callable[[Settings], AbstractContextManager[httpx.Client]]
ONLY_SQLITE = pytest.mark.parametrize("engine_name", ["sqlite"], indirect=True)


def endless(log: GraspLog) -> bytes:
    """Frames of which a detector in numpy takes a minute: each is a call of its own."""
    times = -(-400_000 // len(log))
    frames, corner = times * len(log), np.s_[:, :2, :2]
    displacement, force = (np.tile(field[corner], (times, 1, 1, 1)) for field in (log.displacement, log.force))  # type: ignore[index]
    time_ = log.time[1] * np.arange(frames)
    return container.encode(GraspLog(time_, log.position[:2, :2], displacement, log.element_area, force=force))


@pytest.mark.long
def test_a_job_that_takes_too_long_is_refused_once_and_the_next_is_done(
    serving: Serving, ramp: GraspLog, content: bytes, upload: Any, wait: Any, tmp_path: Path
) -> None:
    with serving(Settings(data_folder=tmp_path, job_cpu_seconds=1.0)) as client:
        greedy = upload(client, endless(ramp), detector="rigid_fit").json()["job"]["id"]
        honest = upload(client, content).json()["job"]["id"]
        ended = wait(client, greedy)
        assert (ended["status"], ended["stage"], ended["deaths"]) == ("refused", "slip_state", 0)
        assert ended["reason"] == "stage slip_state wants more than 1 s of CPU (STICTION_JOB_CPU_SECONDS)"
        assert wait(client, honest)["status"] == "done"


@pytest.fixture
def claim(database: Database, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Claim:
    """To the job of a log, which a worker may do in this process."""
    store = BlobStore(tmp_path)
    monkeypatch.setattr(worker, "_stores", lambda _: (database, store))
    with database.write() as session:
        log = grasp_logs.add(session, NewGraspLog(store.put(b"log"), 3, "npz", "filter", None, "s", 2, 1.0, (1, 1)))
        jobs.add(session, "ingest", "ols", material_id=None, grasp_log_id=log)
        claim = jobs.claim(session, runners.add(session, "host"))
        assert claim is not None
        jobs.start_stage(session, claim, "frames", {})
    return claim


@ONLY_SQLITE
def test_a_job_that_wants_too_much_memory_is_refused_and_its_process_goes_on(
    database: Database, claim: Claim, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def allocate(*_: object) -> None:
        np.ones(2**28 // 8 * 2)  # twice what is allowed

    monkeypatch.setattr(pipeline, "run_job", allocate)
    worker.run_job(worker.StoreConfig(database.url, tmp_path, job_memory_bytes=2**28), claim)
    with database.read() as session:
        job = jobs.get(session, claim.job_id)
    reason = "stage frames wants more than 268435456 bytes of memory (STICTION_JOB_MEMORY_BYTES)"
    assert (job.status, job.reason) == ("refused", reason)
    assert np.ones(2**28 // 8 * 2).all()  # the limit is the job's


@ONLY_SQLITE
def test_a_lattice_whose_reconstruction_has_no_room_is_refused_before_any_of_it_is_written(
    database: Database, claim: Claim, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A log of so many elements went on to 1.9 GB, also after its cancel."""
    monkeypatch.setattr(find_samples, "with_forces", lambda *_: pytest.fail("it has begun"))
    place = 1e-3 * np.stack(np.meshgrid(np.arange(113.0), np.arange(113.0), [0.0], indexing="ij"), axis=-1)[:, :, 0]
    wide = container.encode(GraspLog(np.arange(3.0), place, np.zeros((3, *place.shape)), 1e-6))
    with database.write() as session:
        row = session.get_one(GraspLogRow, jobs.get(session, claim.job_id).grasp_log_id)
        row.sha256 = BlobStore(tmp_path).put(wide)
        sensors.describe(session, "s", Gel(1e6, 0.49, None, 0.0))
    worker.run_job(worker.StoreConfig(database.url, tmp_path, job_memory_bytes=4 * 2**30), claim)
    with database.read() as session:
        job = jobs.get(session, claim.job_id)
    reason = "stage forces wants more than 4294967296 bytes of memory (STICTION_JOB_MEMORY_BYTES)"
    assert (job.status, job.reason) == ("refused", reason)


@ONLY_SQLITE
def test_kernels_are_loaded_before_memory_has_a_limit(
    database: Database, claim: Claim, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Their compiler aborts at it, and the job had died three times where it was to be refused."""
    without, limit_at = resource.getrlimit(resource.RLIMIT_DATA), dict[str, tuple[int, int]]()
    told = lambda what: limit_at.setdefault(what, resource.getrlimit(resource.RLIMIT_DATA))  # noqa: E731
    monkeypatch.setattr(slipcore, "warm_up", told)
    monkeypatch.setattr(pipeline, "run_job", lambda *_: told("the job"))
    pipeline._load_kernels.cache_clear()
    worker.run_job(worker.StoreConfig(database.url, tmp_path), claim)
    assert limit_at.pop("the job")[0] > 0
    assert limit_at == {"filter": without}


def spend(seconds: float) -> None:
    until = time.process_time() + seconds
    while time.process_time() < until:
        pass


def test_a_worker_that_hangs_is_ended_and_its_job_tried_again(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Without taking CPU, as one that is stopped or waits for a disk that is away: it had held its job for ever."""

    async def run() -> None:
        monkeypatch.setattr(worker, "warm_up", partial(spend, 0.0))
        monkeypatch.setattr(worker, "run_job", hang_on_job)
        monkeypatch.setattr(process_executor, "STILL_SECONDS", 1.0)
        executor = process_executor.ProcessExecutor(worker.StoreConfig("sqlite:///x", tmp_path), 60.0)
        await executor.start()
        try:
            with pytest.raises(WorkerDied):
                await executor.run(Claim("job", "runner"))
        finally:
            await executor.close()

    asyncio.run(run())


def test_a_worker_that_takes_too_long_is_ended_and_another_one_begins_anew(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    async def run() -> None:
        monkeypatch.setattr(worker, "warm_up", partial(spend, 0.0))
        monkeypatch.setattr(worker, "run_job", spend_on_job)
        executor = process_executor.ProcessExecutor(worker.StoreConfig("sqlite:///x", tmp_path), 0.3)
        await executor.start()
        try:
            with pytest.raises(LimitReached, match=r"more than 0\.3 s of CPU"):
                await executor.run(Claim("job", "runner"))
            await executor.start()  # another process, whose time counts from its job's begin
            executor._cpu_seconds = 60.0
            await executor.run(Claim("short", "runner"))
        finally:
            await executor.close()

    asyncio.run(run())
    assert limits.cpu_seconds(2**22 + 1) is None


def hang_on_job(_: worker.StoreConfig, _claim: Claim) -> None:
    time.sleep(60.0)


def spend_on_job(_: worker.StoreConfig, claim: Claim) -> None:
    spend(0.0 if claim.job_id == "short" else 60.0)
