"""Durable jobs: rows in the database say what is to be done, worker processes do it.

A job that loses its worker process is given to a new one; a job that was queued or running when the server ended is
taken up at the next start. No numerics run in the server process.
"""

import asyncio
import logging
import multiprocessing
from concurrent.futures import Executor, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool

from db.database import Database
from db.errors import StorageUnavailable
from db.repositories import jobs
from service import worker
from service.worker import Place

logger = logging.getLogger(__name__)

RETRY_SECONDS = 1.0
"""s between two tries to reach a database that is locked, full or away, or to start a worker that does not start."""


class JobPool:
    """Lanes of one worker process each, so that the death of a process is the death of one known job."""

    def __init__(
        self, database: Database, place: Place, *, workers: int, attempts: int, shutdown_seconds: float
    ) -> None:
        self._database, self._place = database, place
        self._workers, self._attempts, self._shutdown_seconds = workers, attempts, shutdown_seconds
        self._queue: asyncio.Queue[str | None] = asyncio.Queue()
        self._lanes: list[_Lane] = []
        self._tasks: list[asyncio.Task[None]] = []
        self._stopping = False

    async def start(self) -> None:
        """Take up what was left, and begin to work."""
        self._loop = asyncio.get_running_loop()
        with self._database.read() as session:
            for job_id in jobs.unfinished(session):
                self._queue.put_nowait(job_id)
        self._lanes = [_Lane() for _ in range(self._workers)]
        self._tasks = [asyncio.create_task(self._work(lane)) for lane in self._lanes]

    def submit(self, job_id: str) -> None:
        """Have a stored job done; may be called from any thread."""
        self._loop.call_soon_threadsafe(self._queue.put_nowait, job_id)

    async def stop(self) -> None:
        """Let running jobs end within the time allowed, then end their workers; their rows stay for the next start."""
        self._stopping = True
        while not self._queue.empty():
            self._queue.get_nowait()
        for _ in self._lanes:
            self._queue.put_nowait(None)
        _, late = await asyncio.wait(self._tasks, timeout=self._shutdown_seconds)
        for lane in self._lanes:
            lane.kill()
        for task in late:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)

    async def _work(self, lane: "_Lane") -> None:
        try:
            await lane.hire()
            while (job_id := await self._queue.get()) is not None:
                await self._do(lane, job_id)
        finally:
            await lane.close()

    async def _do(self, lane: "_Lane", job_id: str) -> None:
        try:
            ended = await self._try(lane, job_id)
        except StorageUnavailable as error:
            logger.warning("job %s waits: %s", job_id, error)
            await asyncio.sleep(RETRY_SECONDS)
            ended = False
        except Exception as error:  # a lane outlives whatever one job throws at it
            logger.exception("job %s failed outside its stages", job_id)
            await asyncio.to_thread(self._fail, job_id, f"{type(error).__name__}: {error}")
            ended = True
        if not ended:
            self._queue.put_nowait(job_id)

    async def _try(self, lane: "_Lane", job_id: str) -> bool:
        """Do a job; False if it is to be done again."""
        try:
            await lane.run(self._place, job_id)
        except BrokenProcessPool:
            if not self._stopping:
                await lane.hire()
                return not await asyncio.to_thread(self._count_death, job_id)
        return True

    def _fail(self, job_id: str, reason: str) -> None:
        try:
            with self._database.write() as session:
                jobs.finish(session, job_id, "failed", reason=reason)
        except Exception:
            logger.exception("job %s could not be marked as failed; the next start takes it up", job_id)

    def _count_death(self, job_id: str) -> bool:
        """Note that the job lost its worker; False if that was once too often."""
        with self._database.write() as session:
            before = jobs.get(session, job_id)
            if before.finished_at is not None:
                return False
            job = jobs.count_death(session, job_id)
            logger.error("job %s lost its worker process, time %d of %d", job_id, job.deaths, self._attempts)
            if job.deaths < self._attempts:
                return True
            reason = f"the worker process died {job.deaths} times, at last in stage {job.stage}"
            jobs.finish(session, job_id, "failed", reason=reason)
            return False


class _Lane:
    """One worker process behind the executor interface."""

    def __init__(self) -> None:
        self._executor: Executor | None = None

    async def hire(self) -> None:
        """Start a worker process and warm it up, in place of the one before."""
        while True:
            await self.close()
            self._executor = ProcessPoolExecutor(1, multiprocessing.get_context("spawn"), worker.start)
            try:
                await asyncio.get_running_loop().run_in_executor(self._executor, worker.warm_up)
            except BrokenProcessPool:
                logger.exception("a worker process did not start")
                await asyncio.sleep(RETRY_SECONDS)
            else:
                return

    async def run(self, place: Place, job_id: str) -> None:
        """Do one job; raises ``BrokenProcessPool`` if the worker process dies under it."""
        await asyncio.get_running_loop().run_in_executor(self._executor, worker.run_job, place, job_id)

    def kill(self) -> None:
        """End the worker process at once (what ``ProcessPoolExecutor.kill_workers`` does from Python 3.14 on)."""
        for process in dict(getattr(self._executor, "_processes", None) or {}).values():
            process.kill()

    async def close(self) -> None:
        """Let the worker process go once it has nothing to do."""
        if self._executor is not None:
            executor, self._executor = self._executor, None
            await asyncio.to_thread(executor.shutdown, cancel_futures=True)
