import asyncio
import threading
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from functools import partial
from pathlib import Path

import pytest

from db.records import Claim
from service.jobs import process_executor, worker
from service.jobs.executor import LimitReached, WorkerDied
from service.jobs.process_executor import ProcessExecutor
from service.jobs.worker import StoreConfig
from service.processes import limits, spawned
from tests.sleeping import replace_sleep


def test_a_worker_that_still_warms_up_holds_no_stop_up(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(worker, "warm_up", partial(time.sleep, 600.0))

    async def stop() -> float:
        executor = ProcessExecutor(StoreConfig("sqlite:///x", tmp_path), 300.0)
        starting = asyncio.create_task(executor.start())
        await asyncio.sleep(2.0)  # by now the process sleeps, or starts still
        began = time.monotonic()
        starting.cancel()
        await asyncio.wait([starting])
        await executor.close()
        return time.monotonic() - began

    assert asyncio.run(stop()) < 60.0  # not 600 s


class Watched:
    """A worker process whose job ends when it is killed, and whose CPU time is told look by look."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, looks: list[float | None]) -> None:
        self.killed = threading.Event()
        told, last = iter(looks), looks[-1]
        monkeypatch.setattr(process_executor, "WATCH_SECONDS", 0.01)
        monkeypatch.setattr(spawned, "process_id", lambda _: 7)
        monkeypatch.setattr(spawned, "kill", lambda _: self.killed.set())
        monkeypatch.setattr(limits, "cpu_seconds", lambda _: next(told, last))

    def run(self, job: Callable[..., None]) -> None:
        executor = ProcessExecutor(StoreConfig("sqlite:///x", Path("there")), 2.0)
        with ThreadPoolExecutor(1) as pool:
            executor._pool = pool
            with pytest.MonkeyPatch.context() as patched:
                patched.setattr(worker, "run_job", job)
                asyncio.run(executor.run(Claim("job", "claim")))

    def wait(self, *_: object) -> None:
        assert self.killed.wait(30.0)
        raise BrokenProcessPool


def test_a_job_that_takes_more_cpu_than_it_may_is_ended(monkeypatch: pytest.MonkeyPatch) -> None:
    watched = Watched(monkeypatch, [5.0, 6.0, None, 7.5])
    with pytest.raises(LimitReached, match=r"^more than 2 s of CPU \(STICTION_JOB_CPU_SECONDS\)$"):
        watched.run(watched.wait)


def test_a_job_may_take_all_the_cpu_that_it_may(monkeypatch: pytest.MonkeyPatch) -> None:
    """It is counted from the job's begin, and a process that is not there yet has none."""
    watched = Watched(monkeypatch, [5.0, 6.0, None, 7.0])
    watched.run(lambda *_: time.sleep(0.2))
    assert not watched.killed.is_set()


def test_a_worker_that_takes_no_cpu_for_long_hangs_and_is_ended(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(process_executor, "STILL_SECONDS", 0.05)
    watched = Watched(monkeypatch, [5.0])
    with pytest.raises(WorkerDied) as ended:
        watched.run(watched.wait)
    assert not isinstance(ended.value, LimitReached)
    assert caplog.messages == ["worker process 7 has hung for 0.05 s, and is ended"]


def test_a_worker_that_goes_on_does_not_hang(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(process_executor, "STILL_SECONDS", 0.05)
    watched = Watched(monkeypatch, [5.0 + k // 3 / 1e3 for k in range(1000)])
    watched.run(lambda *_: time.sleep(0.3))
    assert not watched.killed.is_set()


def test_a_worker_that_dies_under_its_job_is_told_from_one_that_was_ended(monkeypatch: pytest.MonkeyPatch) -> None:
    def die(*_: object) -> None:
        raise BrokenProcessPool("killed")

    with pytest.raises(WorkerDied) as ended:
        Watched(monkeypatch, [5.0]).run(die)
    assert not isinstance(ended.value, LimitReached)
    assert isinstance(ended.value.__cause__, BrokenProcessPool)


def test_a_worker_that_does_not_start_is_tried_again_after_a_second(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    done: list[str] = []

    def warm_up() -> None:
        done.append("warm")
        if done.count("warm") == 1:
            raise BrokenProcessPool

    async def pause(seconds: float) -> None:
        done.append(f"slept {seconds:g}")

    monkeypatch.setattr(worker, "warm_up", warm_up)
    monkeypatch.setattr(spawned, "lower_priority", lambda: done.append("nice"))
    monkeypatch.setattr(spawned, "process", lambda: ThreadPoolExecutor(1))
    replace_sleep(monkeypatch, pause)

    async def start() -> None:
        executor = ProcessExecutor(StoreConfig("sqlite:///x", Path("there")), 2.0)
        await executor.start()
        await executor.close()
        await executor.close()  # there is nothing to close any more

    asyncio.run(start())
    assert done == ["warm", "slept 1", "warm", "nice"]
    assert "a worker process did not start" in caplog.messages[0]
