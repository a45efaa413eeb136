"""An executor of this machine: a worker process, behind the executor interface of ``concurrent.futures``."""

import asyncio
import logging
from concurrent.futures import Executor
from concurrent.futures.process import BrokenProcessPool

from db.records import Claim
from service.jobs import worker
from service.jobs.executor import RETRY_SECONDS, LimitReached, WorkerDied
from service.jobs.worker import StoreConfig
from service.processes import limits, spawned

logger = logging.getLogger(__name__)

WATCH_SECONDS = 0.2
"""s between two looks at what a job has taken."""

STILL_SECONDS = 600.0
"""s in which a worker process that has a job takes no CPU at all, after which it hangs: what else it may wait for it
tries again every few seconds.
"""


class ProcessExecutor:
    """A worker process of its own on this machine; a job may take so many ``cpu_seconds`` of it."""

    def __init__(self, config: StoreConfig, cpu_seconds: float) -> None:
        self._config, self._cpu_seconds = config, cpu_seconds
        self._pool: Executor | None = None
        self.missing: str | None = None

    async def start(self) -> None:
        """Start a worker process and warm it up, in place of the one before; its priority is lowered after that."""
        run = asyncio.get_running_loop().run_in_executor
        while True:
            await self.close()
            self._pool = spawned.process()
            try:
                await run(self._pool, worker.warm_up)
                await run(self._pool, spawned.lower_priority)
            except asyncio.CancelledError:  # nobody waits for what it compiles
                self.kill()
                raise
            except BrokenProcessPool:
                logger.exception("a worker process did not start")
                await asyncio.sleep(RETRY_SECONDS)
            else:
                return

    async def run(self, claim: Claim) -> None:
        """Do one job; raises ``WorkerDied``, also where it hung, and ``LimitReached`` where it took too long."""
        watching = asyncio.create_task(self._end_at_limit())
        died: BrokenProcessPool | None = None
        try:
            await asyncio.get_running_loop().run_in_executor(self._pool, worker.run_job, self._config, claim)
        except BrokenProcessPool as error:
            died = error
        finally:
            is_over = watching.done()
            watching.cancel()
        if is_over and watching.result():  # the process is gone, even if the job was done at that very moment
            raise LimitReached(f"more than {self._cpu_seconds:g} s of CPU (STICTION_JOB_CPU_SECONDS)") from died
        if is_over or died is not None:
            raise WorkerDied from died

    async def _end_at_limit(self) -> bool:
        """End the worker process once it has taken the CPU time that a job may, or hangs; tells whether it took it."""
        worker_id = spawned.process_id(self._pool)
        begin = last = limits.cpu_seconds(worker_id) if worker_id is not None else None
        still = 0.0  # of looks, which a server that is stopped with its worker does not take
        while True:
            await asyncio.sleep(WATCH_SECONDS)
            now = limits.cpu_seconds(worker_id) if worker_id is not None else None
            if begin is None or now is None:
                continue
            still = still + WATCH_SECONDS if now == last else 0.0
            last, is_still = now, still > STILL_SECONDS
            if is_still:
                logger.warning("worker process %s has hung for %g s, and is ended", worker_id, STILL_SECONDS)
            if is_still or now - begin > self._cpu_seconds:
                self.kill()
                return not is_still

    def kill(self) -> None:
        """End the worker process at once."""
        spawned.kill(self._pool)

    async def close(self) -> None:
        """Let the worker process go once it has nothing to do."""
        if self._pool is not None:
            pool, self._pool = self._pool, None
            await asyncio.to_thread(pool.shutdown, cancel_futures=True)
