"""Durable jobs: rows in the database say what is to be done, runners claim them, worker processes do them.

Any number of runners, each with worker processes of its own, share one database. A runner lives in a server or by
itself (``stiction worker``) and runs no numerics. A job that loses its worker process is done by another one; the jobs
of a runner that is dead, seen by its heartbeat, are done by other runners (docs/jobs.md).
"""

import asyncio
import logging
import os
import socket
from collections.abc import Callable, Mapping
from contextlib import suppress
from typing import TypeVar
from weakref import WeakValueDictionary

from sqlalchemy.orm import Session

from db import migrate
from db.database import Database
from db.errors import ClaimLost, SchemaMismatch, StorageUnavailable, StoreMismatch
from db.records import Claim
from db.repositories import jobs, runners, stores
from service.jobs.executor import JobExecutor, LimitReached, WorkerDied, reason_of
from service.observability import logs

logger = logging.getLogger(__name__)

RETRY_SECONDS = 1.0
"""s between two tries to reach a database that is locked, full or away."""

WAKE_SECONDS = 0.003
"""s from a job's storing to the look for it, for the answer goes first: both take the interpreter."""

IDLE_SECONDS = 60.0
"""s without a short job to do, after which the worker process that is there for them ends."""

LOOKS = 5
"""Looks at another runner's heartbeat, as many in one lease, that must all be the same before it counts as dead."""

Result = TypeVar("Result")


class Watch:
    """Which of the other runners are dead: those whose beats stood still in so many looks in a row.

    Looks are counted and not seconds: clocks jump, and while the database was away nobody could beat.
    """

    def __init__(self, looks: int) -> None:
        self._looks = looks
        self._seen: dict[str, tuple[int, int]] = {}

    def look(self, beats: Mapping[str, int]) -> list[str]:
        """The dead among the runners, given the beats of each."""
        before = self._seen
        self._seen = {
            runner: (count, 1 + before[runner][1] if runner in before and before[runner][0] == count else 0)
            for runner, count in beats.items()
        }
        return [runner for runner, (_, same) in self._seen.items() if same >= self._looks]


class JobRunner:
    """Executors of one worker process each, so that the death of a process is the death of one known job.

    ``short_executor`` does short jobs while long ones hold all the others; it has a worker only when that is needed.
    """

    def __init__(
        self,
        database: Database,
        executors: list[JobExecutor],
        short_executor: JobExecutor | None = None,
        *,
        attempts: int,
        lease_seconds: float,
        poll_seconds: float,
        shutdown_seconds: float,
    ) -> None:
        self._database, self._attempts = database, attempts
        self._executors, self._short_executor = executors, short_executor
        self._beat_seconds, self._poll_seconds = lease_seconds / LOOKS, poll_seconds
        self._shutdown_seconds = shutdown_seconds
        self._watch = Watch(LOOKS)
        self._id = ""
        self._at: dict[str, Claim] = {}  # jobs in the executors
        self._executor_of: dict[str, JobExecutor] = {}
        self._orphans: set[str] = set()  # jobs that were ours in the database at the last beat, but in no executor
        self._lost: set[str] = set()  # jobs in an executor that were not ours in the database at the last beat
        self._ended: set[str] = set()  # jobs in an executor whose worker was ended because of that
        self._warming = len(executors)
        self._hiring: set[asyncio.Task[None]] = set()
        self._outdated: SchemaMismatch | None = None
        self._stopping = self._leads = False
        self._woken = {executor: asyncio.Event() for executor in self._all_executors}
        self._endings: WeakValueDictionary[str, asyncio.Event] = WeakValueDictionary()  # of jobs that somebody awaits

    @property
    def missing(self) -> str | None:
        """Why no jobs are taken yet, or no longer."""
        if self._outdated is not None:
            return str(self._outdated)
        missing = next(filter(None, (executor.missing for executor in self._executors)), None)
        if self._warming:
            return f"{self._warming} of {len(self._executors)} workers warm up" + (f": {missing}" if missing else "")
        return missing

    @property
    def leads(self) -> bool:
        """Whether this is the one that does what only one is to do: the oldest runner, as of the last beat."""
        return self._leads

    async def start(self) -> None:
        """Begin to work."""
        self._loop = asyncio.get_running_loop()
        if self._executors:
            self._id = await asyncio.to_thread(self._register)
        self._beating = asyncio.create_task(self._beat())
        self._working = [asyncio.create_task(self._work(executor)) for executor in self._executors]
        if self._short_executor is not None:
            self._working.append(asyncio.create_task(self._work_beside_long_jobs(self._short_executor)))

    def wake(self) -> None:
        """Look for a job soon, since one has just been stored; may be called from any thread."""
        self._loop.call_soon_threadsafe(self._loop.call_later, WAKE_SECONDS, self._wake_executors)

    def ending(self, job_id: str) -> asyncio.Event:
        """Set once an executor of this runner has done with the job; jobs of other runners end unheard."""
        return self._endings.setdefault(job_id, asyncio.Event())

    async def until_outdated(self) -> None:
        """Raise ``SchemaMismatch`` once the schema is not this version's any more."""
        while self._outdated is None:
            await asyncio.sleep(self._beat_seconds)
        raise self._outdated

    async def stop(self) -> None:
        """Let running jobs end within the time allowed, then end their workers; others can take the jobs up."""
        self._stopping = True
        self._wake_executors()
        for task in self._hiring:  # no job waits for a worker that is not there yet
            task.cancel()
        if self._working:
            _, late = await asyncio.wait(self._working, timeout=self._shutdown_seconds)
            for executor in self._all_executors:
                executor.kill()
            for task in late:
                task.cancel()
        self._beating.cancel()
        await asyncio.gather(self._beating, *self._working, return_exceptions=True)
        if self._executors:
            await self._try(lambda: self._remove(self._id))

    async def _work(self, executor: JobExecutor) -> None:
        try:
            await self._start_executor(executor)
            self._warming -= 1
            while self._goes_on:
                if not await self._do_next(executor):
                    await self._wait(executor)
        finally:
            await executor.close()

    async def _work_beside_long_jobs(self, executor: JobExecutor) -> None:
        """Start a worker when a short job waits for long ones, and let it go after a time without such a job."""
        try:
            while self._goes_on:
                if not (self._is_held_up and await self._try(self._short_job_waits)):
                    await self._wait(executor)
                    continue
                await self._start_executor(executor)
                await self._do_short_jobs(executor)
                await executor.close()
        finally:
            await executor.close()

    async def _do_short_jobs(self, executor: JobExecutor) -> None:
        busy_at = self._loop.time()
        while self._goes_on and self._loop.time() - busy_at < IDLE_SECONDS:
            if self._is_held_up and await self._do_next(executor, only_short=True):
                busy_at = self._loop.time()
            else:
                await self._wait(executor)

    async def _do_next(self, executor: JobExecutor, *, only_short: bool = False) -> bool:
        """Do the job whose turn it is; False where there is none."""
        claim = await self._try(lambda: self._claim(only_short=only_short))
        if claim is None:
            return False
        if claim.is_long:  # what waits behind it may be short
            self._wake_executors()
        with logs.log_context(job=claim.job_id):
            await self._do(executor, claim)
        return True

    @property
    def _all_executors(self) -> list[JobExecutor]:
        return self._executors if self._short_executor is None else [*self._executors, self._short_executor]

    @property
    def _goes_on(self) -> bool:
        return not self._stopping and self._outdated is None

    @property
    def _is_held_up(self) -> bool:
        """Whether long jobs hold all executors but the one for short jobs."""
        return sum(claim.is_long for claim in list(self._at.values())) >= len(self._executors)

    def _short_job_waits(self) -> bool:
        with self._database.read() as session:
            return jobs.any_queued(session, only_short=True)

    def _wake_executors(self) -> None:
        for woken in self._woken.values():
            woken.set()

    async def _start_executor(self, executor: JobExecutor) -> None:
        starting = asyncio.create_task(executor.start())
        self._hiring.add(starting)
        starting.add_done_callback(self._hiring.discard)
        await starting

    async def _wait(self, executor: JobExecutor) -> None:
        with suppress(TimeoutError):
            await asyncio.wait_for(self._woken[executor].wait(), self._poll_seconds)
        self._woken[executor].clear()  # only now: whatever is stored during a look is looked for once more

    async def _try(self, step: Callable[[], Result]) -> Result | None:
        """A step that needs the database, in a thread; None where it cannot be had now."""
        try:
            return await asyncio.to_thread(step)
        except StorageUnavailable as error:
            logger.warning("jobs wait: %s", error)
            await asyncio.sleep(RETRY_SECONDS)
        except SchemaMismatch as error:
            logger.error("no more jobs are taken: %s", error)
            self._outdated = error
        except Exception:  # the executors and the heartbeat outlive whatever one step throws
            logger.exception("a step of runner %s failed", self._id)
            await asyncio.sleep(RETRY_SECONDS)
        return None

    def _claim(self, *, only_short: bool) -> Claim | None:
        with self._database.read() as session:  # does not wait for a writer
            if not jobs.any_queued(session, only_short=only_short):
                return None
        with self._database.write(durable=False) as session:
            migrate.require_head(session)
            stores.require(session, self._database.store_id)
            claim = jobs.claim(session, self._id, besides=self._at.keys(), only_short=only_short)
        if claim is not None:
            self._at[claim.job_id] = claim
        return claim

    async def _do(self, executor: JobExecutor, claim: Claim) -> None:
        is_lost, self._executor_of[claim.job_id] = False, executor
        try:
            await executor.run(claim)
        except LimitReached as limit:
            is_lost, want = not self._stopping, str(limit)
            await self._try(lambda: self._refuse(claim, want))
        except WorkerDied:
            is_lost = not self._stopping
            if is_lost:
                await self._try(lambda: self._count_death(claim))
        except (StorageUnavailable, StoreMismatch) as error:
            logger.warning("job %s waits: %s", claim.job_id, error)
            await asyncio.sleep(RETRY_SECONDS)
        except Exception as error:  # an executor outlives whatever one job throws at it
            logger.exception("job %s failed outside its stages", claim.job_id)
            reason = reason_of(error)
            await self._try(lambda: self._fail(claim, reason))
        finally:
            del self._executor_of[claim.job_id]
            if claim.job_id in self._ended:  # the job may have been done at that very moment, and the worker is gone
                self._ended.remove(claim.job_id)
                is_lost = True
            self._at.pop(claim.job_id, None)  # where it is still ours in the database, it is an orphan
            if (ending := self._endings.pop(claim.job_id, None)) is not None:
                ending.set()
        if is_lost and not self._stopping:  # only now: meanwhile another executor may take the job up
            await self._start_executor(executor)

    def _fail(self, claim: Claim, reason: str) -> None:
        try:
            with self._database.write() as session:
                jobs.finish(session, claim, "failed", reason=reason)
        except ClaimLost:
            pass

    def _refuse(self, claim: Claim, want: str) -> None:
        logger.warning("job %s is refused: it wants %s", claim.job_id, want)
        with self._database.write() as session, suppress(ClaimLost):
            jobs.refuse_over_limit(session, claim, want)

    def _count_death(self, claim: Claim) -> None:
        """Note that the job lost its worker, and end it if that was once too often."""
        try:
            with self._database.write() as session:
                job = jobs.count_death(session, claim)
                logger.error("job %s lost its worker process, time %d of %d", job.id, job.deaths, self._attempts)
                if job.deaths < self._attempts:
                    jobs.release(session, claim)
                    return
                reason = f"the worker process died {job.deaths} times, at last in stage {job.stage}"
                jobs.finish(session, claim, "failed", reason=reason)
        except ClaimLost:
            pass  # it had ended, or nobody wants it any more

    async def _beat(self) -> None:
        while True:
            await asyncio.sleep(self._beat_seconds)
            if await self._try(self._beat_once if self._executors else self._check_schema):
                self._wake_executors()

    def _check_schema(self) -> None:
        with self._database.read() as session:
            migrate.require_head(session)

    def _beat_once(self) -> bool:
        """Say that we live, and take the jobs away from runners that do not; True if there are jobs to claim."""
        at = set(self._at)  # before the database is asked: who ends a job there does so first
        with self._database.write(durable=False) as session:
            alive = runners.beat(session, self._id)
            living = runners.list_all(session)
            beats = {runner.id: runner.beats for runner in living if runner.id != self._id}
            claimed = jobs.claimed(session, self._id)
            freed = self._free_orphans(session, claimed)
        self._loop.call_soon_threadsafe(self._end_lost, at - claimed)
        self._leads = alive and living[0].id == self._id
        if not alive and not self._stopping:
            logger.error("runner %s was taken for dead; it goes on under a new name", self._id)
            self._id = self._register()
        dead = self._watch.look(beats)
        for runner in dead:
            self._remove(runner)
        return freed or bool(dead)

    def _free_orphans(self, session: Session, claimed: set[str]) -> bool:
        """Put jobs that the database says are ours, but that no executor does, back: a commit's answer can be lost."""
        orphans = claimed - self._at.keys()
        stay = orphans & self._orphans
        self._orphans = orphans - stay  # who claims one of these anew is given time as with any
        for job_id in stay:
            logger.warning("job %s is queued again: nobody is at it", job_id)
            jobs.release(session, Claim(job_id, self._id))
        return bool(stay)

    def _end_lost(self, lost: set[str]) -> None:
        """End the workers of jobs that are not ours any more, as the last look saw too: they keep others waiting.

        Such a job was cancelled or given to another runner, and learns of it only where its stage ends. Runs in the
        event loop, or the executor could have gone on to another job before its worker is ended.
        """
        for job_id in lost & self._lost:
            if (executor := self._executor_of.get(job_id)) is not None:
                logger.warning("the worker of job %s is ended: nobody wants it any more", job_id)
                self._ended.add(job_id)
                executor.kill()
        self._lost = lost - self._lost

    def _register(self) -> str:
        with self._database.write(durable=False) as session:
            return runners.add(session, f"{socket.gethostname()}:{os.getpid()}")

    def _remove(self, runner: str) -> None:
        with self._database.write() as session:
            released = runners.remove(session, runner)
        if released:
            logger.warning("jobs of runner %s are queued again: %s", runner, ", ".join(released))
