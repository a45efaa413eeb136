"""Lanes: where one job at a time is done, behind the executor interface of ``concurrent.futures``."""

import asyncio
import logging
from concurrent.futures import Executor
from concurrent.futures.process import BrokenProcessPool
from typing import Protocol

from db.errors import DriverMissing
from db.records import Claim
from service.jobs import worker
from service.jobs.worker import Place
from service.processes import limits, spawned

logger = logging.getLogger(__name__)

WATCH_SECONDS = 0.2
"""s between two looks at what a job has taken."""

RETRY_SECONDS = 1.0
"""s between two tries to start a worker that does not start."""


class WorkerDied(Exception):
    """The worker process ended under its job."""


class LimitReached(WorkerDied):
    """The worker process was ended, for its job took more than it may; the message says what."""


class Lane(Protocol):
    """One job at a time.

    ``missing``: what it waits for before it can do jobs, where that is not just a process's start.
    """

    missing: str | None

    async def hire(self) -> None:
        """Make sure that there is a worker and that it is warm."""

    async def run(self, claim: Claim) -> None:
        """Do one job; raises ``WorkerDied``, ``LimitReached`` and ``StorageUnavailable``."""

    def kill(self) -> None:
        """End the worker at once, whatever it does."""

    async def close(self) -> None:
        """Let the worker go once it has nothing to do."""


class ProcessLane:
    """A worker process of its own on this machine; a job may take so many ``cpu_seconds`` of it."""

    def __init__(self, place: Place, cpu_seconds: float) -> None:
        self._place, self._cpu_seconds = place, cpu_seconds
        self._executor: Executor | None = None
        self.missing: str | None = None

    async def hire(self) -> None:
        """Start a worker process and warm it up, in place of the one before; only then it gives way, for jobs wait."""
        run = asyncio.get_running_loop().run_in_executor
        while True:
            await self.close()
            self._executor = spawned.process()
            try:
                await run(self._executor, worker.warm_up)
                await run(self._executor, spawned.give_way)
            except asyncio.CancelledError:  # nobody waits for what it compiles
                self.kill()
                raise
            except BrokenProcessPool:
                logger.exception("a worker process did not start")
                await asyncio.sleep(RETRY_SECONDS)
            else:
                return

    async def run(self, claim: Claim) -> None:
        """Do one job; raises ``WorkerDied``, and ``LimitReached`` where it took too long."""
        watching = asyncio.create_task(self._end_at_limit())
        died: BrokenProcessPool | None = None
        try:
            await asyncio.get_running_loop().run_in_executor(self._executor, worker.run_job, self._place, claim)
        except BrokenProcessPool as error:
            died = error
        finally:
            is_over = watching.done()
            watching.cancel()
        if is_over:  # the process is gone, even if the job was done at that very moment
            raise LimitReached(f"more than {self._cpu_seconds:g} s of CPU (STICTION_JOB_CPU_SECONDS)") from died
        if died is not None:
            raise WorkerDied from died

    async def _end_at_limit(self) -> None:
        """End the worker process once it has taken the CPU time that a job may."""
        worker_id = spawned.process_id(self._executor)
        begin = limits.cpu_seconds(worker_id) if worker_id is not None else None
        while True:
            await asyncio.sleep(WATCH_SECONDS)
            now = limits.cpu_seconds(worker_id) if worker_id is not None else None
            if begin is not None and now is not None and now - begin > self._cpu_seconds:
                self.kill()
                return

    def kill(self) -> None:
        """End the worker process at once."""
        spawned.kill(self._executor)

    async def close(self) -> None:
        """Let the worker process go once it has nothing to do."""
        if self._executor is not None:
            executor, self._executor = self._executor, None
            await asyncio.to_thread(executor.shutdown, cancel_futures=True)


def lanes(place: Place, count: int, dask_address: str | None, cpu_seconds: float) -> list[Lane]:
    """So many worker processes on this machine, or jobs at once on the workers of a Dask scheduler.

    A job of this machine may take ``cpu_seconds``. Raises ``DriverMissing`` for the latter without the library.
    """
    if dask_address is None:
        return [ProcessLane(place, cpu_seconds) for _ in range(count)]
    try:
        from service.jobs.dask_lane import DaskLane  # an extra, and takes a second to load
    except ModuleNotFoundError as error:
        raise DriverMissing(dask_address, error.name or str(error), "Dask cluster", "dask") from error
    return [DaskLane(place, dask_address) for _ in range(count)]


def lane_for_short_jobs(place: Place, count: int, dask_address: str | None, cpu_seconds: float) -> Lane | None:
    """One more worker process beside the ``count`` of ``lanes``, started when somebody hires it.

    None without lanes, and on a Dask cluster: a lane more would get no worker of it while long jobs have them all.
    """
    return None if count == 0 or dask_address is not None else ProcessLane(place, cpu_seconds)
