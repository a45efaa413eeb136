"""An executor on a cluster, without one: what it waits for, and what it makes of a worker's end."""

import asyncio
import sys
from collections.abc import Callable
from concurrent.futures import Future
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from db.records import Claim
from service.jobs import worker
from service.jobs.executor import WorkerDied
from service.jobs.worker import StoreConfig
from tests.sleeping import replace_sleep

LAST: Any = SimpleNamespace(address="tcp://b:2")
CONFIG = StoreConfig("sqlite:///x", Path("there"))


class Cluster:
    """Does what it is given as its plan says: an error, or None for what goes well."""

    def __init__(self, *plan: BaseException | None) -> None:
        self.plan, self.status, self.done, self.closed = list(plan), "running", list[Any](), list[float]()

    def get_executor(self, *, pure: bool) -> "Cluster":
        assert not pure
        return self

    def submit(self, *given: Any) -> Future[None]:
        self.done.append(given)
        future: Future[None] = Future()
        outcome = self.plan.pop(0)
        if isinstance(outcome, asyncio.CancelledError):
            future.cancel()
        elif outcome is not None:
            future.set_exception(outcome)
        else:
            future.set_result(None)
        return future

    async def close(self, timeout: float) -> None:
        self.closed.append(timeout)
        raise OSError("gone")


def executor(cluster: Cluster) -> Any:
    from service.jobs.dask_executor import DaskExecutor  # takes half a second to load

    made = DaskExecutor(CONFIG, "tcp://a:1")
    made._client = cluster
    return made


def killed() -> BaseException:
    from distributed import KilledWorker

    return KilledWorker("job", LAST, 3)


def test_a_job_is_handed_on_with_its_stores() -> None:
    cluster = Cluster(None)
    asyncio.run(executor(cluster).run(Claim("job", "runner")))
    assert cluster.done == [(worker.run_job, CONFIG, Claim("job", "runner"))]


@pytest.mark.parametrize(
    ("error", "told"),
    [
        (asyncio.CancelledError, "the connection to tcp://a:1 is lost"),
        (killed, "run task .job. on 4 different workers"),
    ],
)
def test_a_worker_that_died_is_told_from_a_job_that_failed(error: Callable[[], BaseException], told: str) -> None:
    with pytest.raises(WorkerDied, match=told):
        asyncio.run(executor(Cluster(error())).run(Claim("job", "runner")))
    with pytest.raises(ValueError, match="wrong"):
        asyncio.run(executor(Cluster(ValueError("wrong"))).run(Claim("job", "runner")))


def test_a_cluster_is_left_although_its_scheduler_is_gone() -> None:
    cluster = Cluster()
    made = executor(cluster)

    async def close() -> None:
        await made.close()
        await made.close()

    asyncio.run(close())
    assert cluster.closed == [5.0]
    made.kill()  # nothing: a worker of the cluster has other work
    assert cluster.done == []


def test_a_scheduler_is_asked_again_each_second_until_a_worker_is_warm(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    cluster, slept, missing = Cluster(OSError("refused"), asyncio.CancelledError(), None), list[float](), list[Any]()
    made = executor(cluster)

    async def sleep(seconds: float) -> None:
        slept.append(seconds)
        missing.append(made.missing)

    replace_sleep(monkeypatch, sleep)
    asyncio.run(made.start())
    assert slept == [1.0, 1.0]
    assert missing == ["the Dask scheduler tcp://a:1 does not answer"] * 2
    assert made.missing is None
    assert cluster.done == [(worker.warm_up,)] * 3
    assert caplog.messages[0] == "the Dask scheduler tcp://a:1 does not answer: refused"
    assert sys.modules[type(made).__module__].CONNECT_SECONDS == 5.0
