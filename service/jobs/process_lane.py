"""A lane of this machine: a worker process, behind the executor interface of ``concurrent.futures``."""

import asyncio
import logging
from concurrent.futures import Executor
from concurrent.futures.process import BrokenProcessPool

from db.records import Claim
from service.jobs import worker
from service.jobs.lane import RETRY_SECONDS, LimitReached, WorkerDied
from service.jobs.worker import Place
from service.processes import limits, spawned

logger = logging.getLogger(__name__)

WATCH_SECONDS = 0.2
"""s between two looks at what a job has taken."""


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
