import asyncio
import time
from collections import Counter
from collections.abc import Callable
from contextlib import suppress
from threading import Event
from typing import Any

import pytest
from sqlalchemy import text, update

from db.database import Database
from db.errors import ClaimLost, StorageUnavailable
from db.records import Claim, Job
from db.repositories import jobs, materials, runners
from db.tables import JobRow
from service.jobs.executor import WorkerDied
from service.jobs.runner import LOOKS, JobRunner, Watch
from tests.waiting import wait_until

Do = Callable[[Claim], None]
ATTEMPTS = 3
LEASE_SECONDS = 0.1


class ThreadExecutor:
    """An executor whose worker is a thread that does what it is told to."""

    def __init__(self, do: Do) -> None:
        self._do, self.killed = do, Event()
        self.started = self.closed = 0
        self.missing: str | None = None

    async def start(self) -> None:
        self.started += 1

    async def run(self, claim: Claim) -> None:
        await asyncio.to_thread(self._do, claim)

    def kill(self) -> None:
        self.killed.set()

    async def close(self) -> None:
        self.closed += 1


@pytest.fixture
def queued(database: Database) -> list[str]:
    with database.write() as session:
        material = materials.create(session, "paper", "")
        return [jobs.add(session, "fit", "ols", material_id=material.id) for _ in range(4)]


@pytest.fixture
def working(database: Database, monkeypatch: pytest.MonkeyPatch) -> Callable[..., None]:
    """Let runners ``do`` jobs in threads, while ``meanwhile`` goes on."""
    monkeypatch.setattr("service.jobs.runner.RETRY_SECONDS", 0.001)

    def run(do: Do, meanwhile: Callable[..., object], workers: int = 2, runners: int = 1, **options: Any) -> None:
        async def live() -> None:
            given = {
                "attempts": ATTEMPTS,
                "lease_seconds": LEASE_SECONDS,
                "poll_seconds": 0.01,
                "shutdown_seconds": 5.0,
            }
            all_of_them = [
                JobRunner(database, [ThreadExecutor(do) for _ in range(workers)], **given | options)
                for _ in range(runners)
            ]
            for runner in all_of_them:
                await runner.start()
            await asyncio.to_thread(meanwhile, *all_of_them)
            for runner in all_of_them:
                await runner.stop()

        asyncio.run(live())

    return run


def get(database: Database, job_id: str) -> Job:
    with database.read() as session:
        return jobs.get(session, job_id)


def finish(database: Database, claim: Claim) -> None:
    with database.write() as session:
        jobs.finish(session, claim, "done")


def until_finished(database: Database, ids: list[str]) -> Callable[..., None]:
    return lambda *_: wait_until(lambda: all(get(database, job_id).finished_at for job_id in ids), "the jobs to end")


def test_jobs_are_taken_up_oldest_first(database: Database, queued: list[str], working: Callable[..., None]) -> None:
    with database.write() as session:
        jobs.cancel(session, queued[1], "no longer wanted")
    begun: list[str] = []

    def do(claim: Claim) -> None:
        begun.append(claim.job_id)
        finish(database, claim)

    working(do, until_finished(database, queued), workers=1)
    assert begun == [queued[0], queued[2], queued[3]]
    assert get(database, queued[1]).status == "cancelled"


def test_runners_share_the_jobs_and_each_is_done_once(
    database: Database, queued: list[str], working: Callable[..., None]
) -> None:
    with database.write() as session:
        material = materials.find_id(session, "paper")
        ids = queued + [jobs.add(session, "fit", "ols", material_id=material) for _ in range(20)]
    done: list[Claim] = []

    def do(claim: Claim) -> None:
        done.append(claim)
        time.sleep(0.005)
        finish(database, claim)

    working(do, until_finished(database, ids), runners=2, lease_seconds=10.0)
    assert sorted(claim.job_id for claim in done) == sorted(ids)
    assert len({claim.runner_id for claim in done}) == 2
    with database.read() as session:
        assert runners.list_all(session) == []


def test_a_job_that_is_stored_is_begun_at_once_when_the_runner_is_woken(
    database: Database, queued: list[str], working: Callable[..., None]
) -> None:
    begun, added = list[str](), list[str]()

    def do(claim: Claim) -> None:
        begun.append(claim.job_id)
        finish(database, claim)

    def store(runner: JobRunner) -> None:
        until_finished(database, queued)(runner)
        with database.write() as session:
            added.append(jobs.add(session, "fit", "ols", material_id=materials.find_id(session, "paper")))
        runner.wake()
        until_finished(database, added)(runner)

    longer_than_waits = 600.0
    working(do, store, poll_seconds=longer_than_waits, lease_seconds=longer_than_waits)
    assert begun[-1:] == added


def test_a_job_that_loses_its_worker_is_tried_again_and_then_has_failed(
    database: Database, queued: list[str], working: Callable[..., None]
) -> None:
    poison, unlucky, *fine = queued
    tries: Counter[str] = Counter()

    def do(claim: Claim) -> None:
        tries[claim.job_id] += 1
        if claim.job_id == poison or (claim.job_id == unlucky and tries[claim.job_id] == 1):
            with database.write() as session:
                jobs.start_stage(session, claim, "slip_state", {})
            raise WorkerDied
        finish(database, claim)

    working(do, until_finished(database, queued))
    assert tries == {poison: ATTEMPTS, unlucky: 2} | dict.fromkeys(fine, 1)
    failed = get(database, poison)
    assert (failed.status, failed.deaths, failed.stage) == ("failed", ATTEMPTS, "slip_state")
    assert failed.reason == "the worker process died 3 times, at last in stage slip_state"
    assert (get(database, unlucky).status, get(database, unlucky).deaths) == ("done", 1)


def test_a_worker_that_dies_after_the_end_of_its_job_changes_nothing(
    database: Database, queued: list[str], working: Callable[..., None]
) -> None:
    def do(claim: Claim) -> None:
        finish(database, claim)
        raise WorkerDied

    working(do, until_finished(database, queued))
    assert {get(database, job_id).status for job_id in queued} == {"done"}
    assert {get(database, job_id).deaths for job_id in queued} == {0}


def test_a_job_waits_for_storage_without_losing_an_attempt(
    database: Database, queued: list[str], working: Callable[..., None]
) -> None:
    tries: Counter[str] = Counter()

    def do(claim: Claim) -> None:
        tries[claim.job_id] += 1
        if tries[claim.job_id] <= ATTEMPTS:
            raise StorageUnavailable("database is locked")
        finish(database, claim)

    working(do, until_finished(database, queued))
    assert set(tries.values()) == {ATTEMPTS + 1}
    assert {get(database, job_id).deaths for job_id in queued} == {0}


def test_a_job_that_nobody_is_at_is_queued_again_at_the_second_look_of_each_claim(
    database: Database, queued: list[str]
) -> None:
    given = {"attempts": ATTEMPTS, "lease_seconds": 1.0, "poll_seconds": 1.0, "shutdown_seconds": 1.0}
    runner = JobRunner(database, [ThreadExecutor(lambda _: None)], **given)  # type: ignore[arg-type]
    with database.write() as session:
        runner._id = runners.add(session, "host:1")
    for _ in range(2):
        with database.write() as session:
            claim = jobs.claim(session, runner._id)
        assert claim is not None
        assert claim.job_id == queued[0]
        for freed in (False, True):
            with database.write() as session:
                assert runner._free_orphans(session, jobs.claimed(session, runner._id)) is freed
        assert get(database, queued[0]).status == "queued"


def test_a_job_is_not_begun_twice_at_once_by_a_runner_whose_claim_the_database_has_forgotten(
    database: Database, queued: list[str], working: Callable[..., None]
) -> None:
    """As PostgreSQL does in a crash: that a job was claimed waits for no disk."""
    tries: Counter[str] = Counter()
    tries_meanwhile = []

    def do(claim: Claim) -> None:
        tries[claim.job_id] += 1
        if sum(tries.values()) > 1:
            finish(database, claim)
            return
        with database.write() as session:
            session.execute(update(JobRow).where(JobRow.id == claim.job_id).values(status="queued", runner_id=None))
        wait_until(
            lambda: all(get(database, other).finished_at for other in queued if other != claim.job_id),
            "the others to end",
        )
        time.sleep(0.1)
        tries_meanwhile.append(tries[claim.job_id])
        with database.write() as session, pytest.raises(ClaimLost):
            jobs.start_stage(session, claim, "samples", {})

    working(do, until_finished(database, queued))
    assert tries_meanwhile == [1]
    assert {get(database, job_id).status for job_id in queued} == {"done"}


def test_jobs_of_a_runner_that_is_silent_are_done_by_another_one(
    database: Database, queued: list[str], working: Callable[..., None], claim: Callable[[], Claim]
) -> None:
    dead = [claim(), claim()]
    done: list[str] = []

    def do(claim: Claim) -> None:
        done.append(claim.job_id)
        finish(database, claim)

    working(do, until_finished(database, queued))
    assert sorted(done) == sorted(queued)
    assert set(done[-2:]) == {lost.job_id for lost in dead}  # each in an executor, at once
    assert {get(database, job_id).deaths for job_id in queued} == {0}


def test_a_runner_that_was_taken_for_dead_goes_on_under_a_new_name(
    database: Database, queued: list[str], working: Callable[..., None]
) -> None:
    claims: list[Claim] = []

    def do(claim: Claim) -> None:
        claims.append(claim)
        if len(claims) == 1:
            with database.write() as session:
                assert runners.remove(session, claim.runner_id) == [claim.job_id]
        else:
            finish(database, claim)

    working(do, until_finished(database, queued), workers=1)
    assert len({claim.runner_id for claim in claims}) == 2
    assert Counter(claim.job_id for claim in claims) == {queued[0]: 2} | dict.fromkeys(queued[1:], 1)


def test_stopping_leaves_what_has_not_begun_to_others(
    database: Database, queued: list[str], working: Callable[..., None]
) -> None:
    begun: list[str] = []

    def do(claim: Claim) -> None:
        begun.append(claim.job_id)
        time.sleep(0.3)
        finish(database, claim)

    working(do, lambda _: wait_until(lambda: len(begun) == 2, "two to begin"), lease_seconds=10.0)
    assert sorted(begun) == sorted(queued[:2])
    assert [get(database, job_id).status for job_id in queued] == ["done", "done", "queued", "queued"]


def test_a_job_that_does_not_end_in_time_is_left_to_others_by_a_stopping_runner(
    database: Database, queued: list[str], working: Callable[..., None]
) -> None:
    begun: list[str] = []

    def do(claim: Claim) -> None:
        begun.append(claim.job_id)
        time.sleep(0.3)

    working(do, lambda _: wait_until(lambda: len(begun) == 1, "one to begin"), workers=1, shutdown_seconds=0.05)
    assert {get(database, job_id).status for job_id in queued} == {"queued"}
    assert {get(database, job_id).deaths for job_id in queued} == {0}


def test_an_executor_outlives_what_a_job_throws_at_it(
    database: Database, queued: list[str], working: Callable[..., None]
) -> None:
    def do(claim: Claim) -> None:
        if claim.job_id == queued[0]:
            raise RuntimeError("database disk image is malformed\n[SQL: SELECT secret]")
        finish(database, claim)

    working(do, until_finished(database, queued), workers=1)
    assert [get(database, job_id).status for job_id in queued] == ["failed", "done", "done", "done"]
    assert get(database, queued[0]).reason == "RuntimeError: database disk image is malformed"


def test_the_worker_of_a_job_that_was_cancelled_is_ended_where_it_does_not_end_by_itself(
    database: Database, queued: list[str]
) -> None:
    given = {"attempts": ATTEMPTS, "lease_seconds": LEASE_SECONDS, "poll_seconds": 0.01, "shutdown_seconds": 5.0}

    def do(claim: Claim) -> None:
        if claim.job_id == queued[0]:
            with database.write() as session:
                jobs.cancel(session, claim.job_id, "it takes for ever")
            assert executor.killed.wait(timeout=60.0)
            raise WorkerDied
        finish(database, claim)

    executor = ThreadExecutor(do)

    async def live() -> None:
        runner = JobRunner(database, [executor], **given)  # type: ignore[arg-type]
        await runner.start()
        await asyncio.to_thread(until_finished(database, queued))
        await runner.stop()

    asyncio.run(live())
    ends = [(job.status, job.deaths) for job in (get(database, job_id) for job_id in queued)]
    assert ends == [("cancelled", 0), *[("done", 0)] * 3]
    assert executor.started == 2  # the next jobs have a worker of their own


def test_a_worker_is_ended_only_while_it_is_at_the_job_that_nobody_wants(
    database: Database, queued: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    given = {"attempts": ATTEMPTS, "lease_seconds": LEASE_SECONDS, "poll_seconds": 0.01, "shutdown_seconds": 5.0}
    begun, may_end, has_gone_on = [], Event(), Event()

    def do(claim: Claim) -> None:
        begun.append(claim.job_id)
        if claim.job_id == queued[0]:
            with database.write() as session:
                jobs.cancel(session, claim.job_id, "it takes for ever")
            assert may_end.wait(timeout=60.0)  # by itself, at the moment when its worker is to be ended
        else:
            has_gone_on.set()
            finish(database, claim)

    executor = ThreadExecutor(do)
    begun_at_kill: list[list[str]] = []
    monkeypatch.setattr(executor, "kill", lambda: begun_at_kill.append([*begun]))

    def warned(*_: object) -> None:
        may_end.set()
        has_gone_on.wait(timeout=0.3)

    monkeypatch.setattr("service.jobs.runner.logger.warning", warned)

    async def live() -> None:
        runner = JobRunner(database, [executor], **given)  # type: ignore[arg-type]
        await runner.start()
        await asyncio.to_thread(until_finished(database, queued))
        await runner.stop()

    asyncio.run(live())
    assert begun_at_kill[0] == [queued[0]]
    assert executor.started == 2  # the others have a worker that lives
    assert {get(database, job_id).deaths for job_id in queued} == {0}


def test_the_worker_of_a_job_that_ends_is_given_time(database: Database, queued: list[str]) -> None:
    given = {"attempts": ATTEMPTS, "lease_seconds": 1.0, "poll_seconds": 1.0, "shutdown_seconds": 1.0}
    executor = ThreadExecutor(lambda _: None)
    runner = JobRunner(database, [executor], **given)  # type: ignore[arg-type]
    runner._executor_of[queued[0]] = executor
    for lost, is_ended in (
        (set[str](), False),
        ({queued[0]}, False),
        (set(), False),
        ({queued[0]}, False),
        ({queued[0]}, True),
    ):
        runner._end_lost(lost)
        assert executor.killed.is_set() is is_ended


def test_a_runner_takes_no_jobs_of_a_newer_schema_and_says_so(
    database: Database, queued: list[str], working: Callable[..., None]
) -> None:
    with database.write() as session:
        session.execute(text("UPDATE alembic_version SET version_num = '9999'"))
    said: list[str | None] = []

    def note(*runners: JobRunner) -> None:
        wait_until(lambda: all("newer" in (runner.missing or "") for runner in runners), "the runners to see it")
        said.extend(runner.missing for runner in runners)

    working(lambda claim: finish(database, claim), note)
    working(lambda claim: finish(database, claim), note, workers=0)  # a server without workers
    assert [reason and "run a newer version" in reason for reason in said] == [True, True]
    assert {get(database, job_id).status for job_id in queued} == {"queued"}


def test_whoever_waits_for_a_job_hears_its_end(
    database: Database, queued: list[str], working: Callable[..., None]
) -> None:
    """Everyone who waits for it, and nobody who waits for another."""
    is_heard = Event()

    def do(claim: Claim) -> None:
        is_heard.wait(60.0)
        finish(database, claim)

    def listen(runner: JobRunner) -> None:
        ends, other = [runner.ending(job) for job in queued], runner.ending("another")
        assert [runner.ending(job) for job in queued] == ends
        assert not any(end.is_set() for end in ends)
        is_heard.set()
        wait_until(lambda: all(end.is_set() for end in ends), "the ends to be heard")
        assert not other.is_set()

    working(do, listen)


@pytest.mark.parametrize("executors", [0, 1, 3])
def test_a_runner_says_how_many_workers_it_waits_for_and_why(database: Database, executors: int) -> None:
    """Those that have begun are not waited for, and a server without workers waits for none."""
    all_of_them = [ThreadExecutor(lambda _: None) for _ in range(executors)]
    given = {"attempts": ATTEMPTS, "lease_seconds": 60.0, "poll_seconds": 60.0, "shutdown_seconds": 5.0}

    async def live() -> list[str | None]:
        runner = JobRunner(database, all_of_them, **given)  # type: ignore[arg-type]
        said = [runner.missing]
        for each in all_of_them:
            each.missing = "no cluster"
        said.append(runner.missing)
        for each in all_of_them:
            each.missing = None
        await runner.start()
        with suppress(TimeoutError):
            async with asyncio.timeout(20.0):
                while runner.missing is not None:
                    await asyncio.sleep(0.001)
        said.append(runner.missing)
        await runner.stop()
        return said

    waits = f"{executors} of {executors} workers warm up"
    assert asyncio.run(live()) == ([waits, f"{waits}: no cluster", None] if executors else [None] * 3)


def test_a_runner_is_dead_once_its_beats_stand_still() -> None:
    watch = Watch(LOOKS)
    for look in range(LOOKS):
        assert watch.look({"dead": 7, "alive": look, "slow": look // 2}) == []
    assert watch.look({"dead": 7, "alive": LOOKS, "slow": LOOKS // 2}) == ["dead"]
    assert watch.look({"alive": 9, "new": 0}) == []
    assert watch.look({"dead": 7}) == []  # seen anew


def test_a_job_that_lost_its_worker_does_not_wait_for_the_next_one(
    database: Database, queued: list[str], working: Callable[..., None], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A Dask scheduler may be away for long."""
    lost: list[ThreadExecutor] = []

    async def start(executor: ThreadExecutor) -> None:
        while executor in lost:
            await asyncio.sleep(0.01)

    async def run(executor: ThreadExecutor, claim: Claim) -> None:
        if not lost:
            lost.append(executor)
            raise WorkerDied
        await asyncio.to_thread(finish, database, claim)

    monkeypatch.setattr(ThreadExecutor, "start", start)
    monkeypatch.setattr(ThreadExecutor, "run", run)
    working(finish, until_finished(database, queued), lease_seconds=10.0)
    assert sorted(get(database, job_id).deaths for job_id in queued) == [0, 0, 0, 1]


class HeldExecutors:
    """Long jobs that hold their executor until they may end; short ones, which end at once, have one more."""

    def __init__(self, database: Database) -> None:
        self.database, self.begun, self.may_end = database, set[str](), Event()
        self.short_executor = ThreadExecutor(self.do)
        with database.write() as session:
            self.material_id = materials.create(session, "paper", "").id

    def add(self, *, is_long: bool) -> str:
        with self.database.write() as session:
            return jobs.add(session, "fit", "ols", material_id=self.material_id, is_long=is_long)

    def do(self, claim: Claim) -> None:
        self.begun.add(claim.job_id)
        if claim.is_long:
            assert self.may_end.wait(30.0)
        finish(self.database, claim)

    def until_done(self, *ids: str) -> None:
        until_finished(self.database, list(ids))()


@pytest.fixture
def held(database: Database) -> HeldExecutors:
    return HeldExecutors(database)


def test_short_jobs_do_not_wait_for_long_ones_that_hold_all_executors(
    held: HeldExecutors, working: Callable[..., None], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("service.jobs.runner.IDLE_SECONDS", 0.1)
    long = [held.add(is_long=True) for _ in range(3)]

    def meanwhile(_: JobRunner) -> None:
        wait_until(lambda: len(held.begun) == 2, "two to begin")
        for _ in range(2):  # a worker that was idle ends, and there is another one when it is needed again
            short = [held.add(is_long=False) for _ in range(3)]
            closed = held.short_executor.closed
            held.until_done(*short)
            wait_until(lambda closed=closed: held.short_executor.closed > closed, "its closing")  # type: ignore[misc]
        assert held.begun & set(long) == set(long[:2])
        held.may_end.set()
        held.until_done(*long)

    working(held.do, meanwhile, short_executor=held.short_executor)
    assert held.short_executor.started == 2


def test_no_worker_is_started_for_short_jobs_with_an_executor(
    held: HeldExecutors, working: Callable[..., None]
) -> None:
    long = held.add(is_long=True)

    def meanwhile(_: JobRunner) -> None:
        held.until_done(*(held.add(is_long=False) for _ in range(5)))
        held.may_end.set()
        held.until_done(long, held.add(is_long=True))

    working(held.do, meanwhile, short_executor=held.short_executor)
    assert held.short_executor.started == 0


def test_short_jobs_that_were_there_first_are_begun_when_a_long_one_takes_the_executor(
    held: HeldExecutors, working: Callable[..., None]
) -> None:
    long, short = held.add(is_long=True), held.add(is_long=False)

    def meanwhile(_: JobRunner) -> None:
        held.until_done(short)
        held.may_end.set()
        held.until_done(long)

    working(held.do, meanwhile, workers=1, short_executor=held.short_executor, poll_seconds=60.0, lease_seconds=600.0)
    assert held.short_executor.started == 1


@pytest.mark.parametrize("engine_name", ["sqlite"], indirect=True)
def test_the_runner_that_was_there_first_leads_the_others_and_then_the_next_one(database: Database) -> None:
    async def live() -> None:
        options: Any = {"attempts": 1, "lease_seconds": 60.0, "poll_seconds": 60.0, "shutdown_seconds": 0.0}
        first, second = (JobRunner(database, [ThreadExecutor(lambda _: None)], **options) for _ in range(2))
        assert not first.leads  # before it is known
        for runner in (first, second):
            await runner.start()
            await asyncio.to_thread(runner._beat_once)
        assert (first.leads, second.leads) == (True, False)
        await first.stop()
        await asyncio.to_thread(second._beat_once)
        assert second.leads
        await second.stop()

    asyncio.run(live())
