from concurrent.futures import Future, ThreadPoolExecutor, wait
from datetime import UTC, datetime, timedelta

import pytest
from sqlalchemy import select, update

from db.database import Database
from db.errors import StorageUnavailable
from db.records import NewGraspLog, SeenClock
from db.repositories import grasp_logs, stores, uploads
from db.tables import GraspLogRow
from service.jobs import steady_clock
from service.jobs.steady_clock import STEADY, SteadyClock, doubt

BEGIN = datetime(2026, 11, 26, tzinfo=UTC)


class Clocks:
    """The clock that somebody may set, and those that nobody does, s: one stands still while the machine sleeps."""

    CLOCK_BOOTTIME = 7

    def __init__(self) -> None:
        self.wall, self.since_start, self.awake = BEGIN, 1000.0, 1000.0

    def go(self, passed: timedelta, set_by: timedelta = timedelta(), asleep: timedelta = timedelta()) -> None:
        self.wall += passed + set_by
        self.since_start += passed.total_seconds()
        self.awake += (passed - asleep).total_seconds()

    def now(self) -> datetime:
        return self.wall

    def clock_gettime(self, clock: int) -> float:
        assert clock == self.CLOCK_BOOTTIME
        return self.since_start

    def monotonic(self) -> float:
        return self.awake


@pytest.fixture
def clocks(monkeypatch: pytest.MonkeyPatch) -> Clocks:
    made = Clocks()
    monkeypatch.setattr(steady_clock, "now", made.now)
    monkeypatch.setattr(steady_clock, "time", made)
    return made


LOOK = timedelta(minutes=1)
DAYS = [timedelta(days=200), timedelta(days=-200), timedelta(hours=1)]


@pytest.fixture
def store(database: Database) -> Database:
    with database.write() as session:
        stores.set_id(session, "1" * 32)
    return database


def believed(clock: SteadyClock, clocks: Clocks) -> SteadyClock:
    """The clock, once it is."""
    assert not clock.is_believed()
    clocks.go(STEADY)
    assert clock.is_believed()
    return clock


def log_of(store: Database, clocks: Clocks) -> str:
    """A log that comes in now."""
    with store.write() as session:
        log_id = grasp_logs.add(
            session, NewGraspLog(f"{clocks.since_start:064.0f}", 1, "npz", "x", None, "s", 2, 1.0, (2, 2))
        )
        own = update(GraspLogRow).where(GraspLogRow.id == log_id)
        session.execute(own.values(created_at=clocks.wall, file_since=clocks.wall))
    return log_id


def since(store: Database, log_id: str) -> datetime:
    with store.read() as session:
        return session.scalars(select(GraspLogRow.file_since).where(GraspLogRow.id == log_id)).one()


@pytest.mark.parametrize("by", DAYS)
def test_a_clock_that_jumps_is_not_believed_for_a_day(store: Database, clocks: Clocks, by: timedelta) -> None:
    """One that was 200 days ahead for a minute had deleted all uploads."""
    clock = believed(SteadyClock(store), clocks)
    clocks.go(LOOK, by)
    assert not clock.is_believed()
    clocks.go(LOOK)
    assert not clock.is_believed()
    clocks.go(LOOK, -by)  # set right again
    assert not clock.is_believed()
    clocks.go(STEADY - LOOK)
    assert not clock.is_believed()
    clocks.go(LOOK)
    assert clock.is_believed()


def test_a_clock_that_is_set_by_seconds_is_believed(store: Database, clocks: Clocks) -> None:
    clock = believed(SteadyClock(store), clocks)
    for step in (0.0, 5.0, -5.0, 30.0):
        clocks.go(LOOK, timedelta(seconds=step))
        assert clock.is_believed()


NIGHT = timedelta(hours=8)


def test_a_machine_that_sleeps_at_night_believes_its_clock(store: Database, clocks: Clocks) -> None:
    """Each wake had been a jump, after which nothing went by age for a day."""
    clock = believed(SteadyClock(store), clocks)
    clocks.go(NIGHT, asleep=NIGHT)
    assert clock.is_believed()


@pytest.mark.parametrize("by", [timedelta(days=3), timedelta(days=3650)])
def test_a_clock_that_went_on_for_days_asleep_is_watched_anew(store: Database, clocks: Clocks, by: timedelta) -> None:
    """Both are set by the machine's own clock as it wakes: where that was wrong, uploads of ten years were deleted."""
    clock = believed(SteadyClock(store), clocks)
    log_id = log_of(store, clocks)
    clocks.go(by, asleep=by)
    assert not clock.is_believed()
    assert since(store, log_id) == clocks.wall
    clocks.go(STEADY)
    assert clock.is_believed()


def test_without_a_clock_that_goes_on_asleep_a_night_is_a_jump(
    store: Database, clocks: Clocks, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delattr(Clocks, "CLOCK_BOOTTIME")
    clock = believed(SteadyClock(store), clocks)
    clocks.go(NIGHT, asleep=NIGHT)
    assert not clock.is_believed()


@pytest.mark.parametrize("by", DAYS[:2])
def test_a_clock_that_is_wrong_at_a_start_is_not_believed(store: Database, clocks: Clocks, by: timedelta) -> None:
    """Nor at the next, whatever comes in meanwhile: by one log, which it dated itself, it had deleted all."""
    believed(SteadyClock(store), clocks)
    clocks.go(LOOK, by)
    for _ in range(3):
        clock = SteadyClock(store)
        assert not clock.is_believed()
        log_of(store, clocks)
        clocks.go(LOOK)
        assert not clock.is_believed()


def test_a_service_that_is_started_daily_believes_the_clock_at_last(store: Database, clocks: Clocks) -> None:
    """Whatever the age of its newest log, by which it had not."""
    told = []
    for _ in range(4):
        clock = SteadyClock(store)
        clock.is_believed()
        clocks.go(timedelta(hours=8))
        told.append(clock.is_believed())
        clocks.go(timedelta(hours=16))
    assert told == [False, False, True, True]


def test_time_without_a_look_does_not_count(store: Database, clocks: Clocks) -> None:
    """Nor that in which another process looked counts twice."""
    first, other = SteadyClock(store), SteadyClock(store)
    assert not first.is_believed()
    assert not other.is_believed()
    clocks.go(timedelta(hours=13))
    assert not first.is_believed()
    assert not other.is_believed()
    clocks.go(timedelta(hours=10))
    assert not SteadyClock(store).is_believed()


def test_what_came_in_by_a_clock_that_was_behind_is_no_older_once_it_is_right(store: Database, clocks: Clocks) -> None:
    """It had been deleted minutes after the clock was set, or a day after."""
    clock = believed(SteadyClock(store), clocks)
    before = log_of(store, clocks)
    at = clocks.wall
    clocks.go(LOOK, -timedelta(days=200))
    clock.is_believed()
    behind = log_of(store, clocks)
    clocks.go(LOOK, timedelta(days=200))
    clock.is_believed()
    assert clocks.wall - since(store, behind) == LOOK
    assert abs(since(store, before) - at) <= 3 * LOOK


def test_what_came_in_before_the_first_look_at_a_new_clock_counts_as_new(store: Database, clocks: Clocks) -> None:
    SteadyClock(store).is_believed()
    log = log_of(store, clocks)
    clocks.go(LOOK, timedelta(days=200))
    SteadyClock(store).is_believed()
    assert since(store, log) == clocks.wall


@pytest.mark.parametrize("looks", [0, 1, 3])
def test_a_second_server_whose_clock_is_behind_makes_no_file_older(store: Database, clocks: Clocks, looks: int) -> None:
    """At its start it had dated all files back, and the first deleted them once a day had passed by its own clock."""
    first = believed(SteadyClock(store), clocks)
    log, at = log_of(store, clocks), clocks.wall
    clocks.wall -= timedelta(days=200)
    second = SteadyClock(store)
    second.begin()
    for _ in range(looks):
        look(second, clocks, timedelta())
    clocks.wall += timedelta(days=200)
    clocks.go(LOOK)
    assert first.is_believed() == (looks == 0)
    assert at <= since(store, log) <= clocks.wall


@pytest.mark.parametrize("gone", [False, True])
def test_a_file_that_comes_in_by_a_machine_whose_clock_is_behind_counts_as_new(
    store: Database, clocks: Clocks, monkeypatch: pytest.MonkeyPatch, *, gone: bool
) -> None:
    """It had gone a minute later, by the clock of the machine that looks."""
    believed(SteadyClock(store), clocks)
    monkeypatch.setattr(uploads, "now", lambda: clocks.wall - timedelta(days=200))
    with store.write() as session:
        log = grasp_logs.add(session, NewGraspLog("0" * 64, 1, "npz", "x", None, "s", 2, 1.0, (2, 2)))
        if gone:
            session.execute(update(GraspLogRow).values(file_state="gone", file_since=BEGIN))
            assert uploads.bring_back(session, "0" * 64)
    assert since(store, log) == clocks.wall


def test_a_file_of_a_machine_whose_clock_is_ahead_is_kept_no_longer_than_a_new_one(
    store: Database, clocks: Clocks
) -> None:
    clock = believed(SteadyClock(store), clocks)
    clocks.wall += timedelta(days=200)
    log = log_of(store, clocks)
    clocks.wall -= timedelta(days=200)
    clocks.go(LOOK)
    assert clock.is_believed()
    assert since(store, log) == clocks.wall


def test_a_clock_is_noted_before_the_first_look_at_a_new_store(store: Database, clocks: Clocks) -> None:
    clocks.wall -= timedelta(days=200)
    clock = SteadyClock(store)
    clock.begin()
    log = log_of(store, clocks)
    look(clock, clocks, timedelta(days=200))
    assert since(store, log) == clocks.wall


def look(clock: SteadyClock, clocks: Clocks, by: timedelta) -> None:
    """The next look at a clock that has been set."""
    clocks.go(LOOK, by)
    assert not clock.is_believed()


def test_what_came_in_before_the_look_that_sees_the_jump_is_not_older_by_it(store: Database, clocks: Clocks) -> None:
    clock = believed(SteadyClock(store), clocks)
    clocks.go(LOOK / 2, timedelta(days=-200))
    log = log_of(store, clocks)
    clocks.go(LOOK / 2)
    assert not clock.is_believed()
    look(clock, clocks, timedelta(days=200))
    assert clocks.wall - since(store, log) == 3 / 2 * LOOK


def test_a_file_brought_back_while_the_clock_was_behind_is_not_older_by_it(
    store: Database, clocks: Clocks, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(uploads, "now", clocks.now)
    clock = believed(SteadyClock(store), clocks)
    log = log_of(store, clocks)
    with store.write() as session:
        session.execute(update(GraspLogRow).values(file_state="gone"))
    look(clock, clocks, timedelta(days=-200))
    with store.write() as session:
        assert uploads.bring_back(session, session.scalars(select(GraspLogRow.sha256)).one())
    look(clock, clocks, timedelta(days=200))
    assert clocks.wall - since(store, log) == LOOK


def test_a_clock_that_is_set_right_in_steps_makes_no_file_older(store: Database, clocks: Clocks) -> None:
    clock = believed(SteadyClock(store), clocks)
    look(clock, clocks, timedelta(days=-200))
    log = log_of(store, clocks)
    for days in (90, 3, 7, 100):
        clocks.go(STEADY + LOOK)
        clock.is_believed()
        look(clock, clocks, timedelta(days=days))
    age = 4 * (STEADY + 2 * LOOK)
    assert timedelta() <= clocks.wall - since(store, log) <= age


@pytest.mark.parametrize("restarted", [False, True])
def test_a_clock_that_was_ahead_keeps_no_file_for_longer_than_a_new_one(
    store: Database, clocks: Clocks, *, restarted: bool
) -> None:
    """For ten years it had, or for good."""
    clock = believed(SteadyClock(store), clocks)
    before = log_of(store, clocks)
    look(SteadyClock(store) if restarted else clock, clocks, timedelta(days=3650))
    ahead = log_of(store, clocks)
    look(SteadyClock(store) if restarted else clock, clocks, timedelta(days=-3650))
    assert [since(store, log) for log in (before, ahead)] == [clocks.wall] * 2


def test_a_clock_that_jumps_by_little_every_week_lets_files_grow_old(store: Database, clocks: Clocks) -> None:
    """As that of a machine which stands still while it is saved."""
    clock = believed(SteadyClock(store), clocks)
    log, at = log_of(store, clocks), clocks.wall
    for _ in range(10):
        for _ in range(7):
            clocks.go(timedelta(days=1))
            clock.is_believed()
        look(clock, clocks, timedelta(minutes=2))
    assert abs(since(store, log) - at - 10 * timedelta(minutes=2)) < timedelta(seconds=1)


def test_a_database_without_a_store_id_is_not_looked_at_in_vain(database: Database, clocks: Clocks) -> None:
    del clocks
    with pytest.raises(StorageUnavailable, match="no store id"):
        SteadyClock(database).is_believed()


def doubts(store: Database) -> str:
    with store.read() as session:
        return doubt(session) or ""


def test_a_command_doubts_a_clock_that_no_server_vouches_for(store: Database, clocks: Clocks) -> None:
    assert not doubts(store)
    log_of(store, clocks)
    clocks.go(STEADY + LOOK)
    assert "the newest log is of 2026-11-26" in doubts(store)
    clock = SteadyClock(store)
    clock.is_believed()
    assert "has been watched for less than a day" in doubts(store)
    clocks.go(STEADY)
    clock.is_believed()
    assert not doubts(store)
    clocks.go(timedelta(days=200))
    assert "a server last saw 2026-11-28" in doubts(store)


def test_a_look_overwrites_nothing_that_another_process_saw_meanwhile(
    store: Database, clocks: Clocks, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The other one saw a jump, say: the time for which the clock was steady before must not come back."""
    clock = believed(SteadyClock(store), clocks)

    def note() -> None:
        with store.write() as session:
            stores.note_clock(session, SeenClock(clocks.wall, 0.0))

    with ThreadPoolExecutor(1) as other:
        asked: list[Future[None]] = []

        def jump(*_: object) -> None:
            asked.append(other.submit(note))
            wait(asked, timeout=0.2)

        monkeypatch.setattr(steady_clock, "_jump", jump)
        clock.is_believed()
        asked[0].result(30.0)
    with store.read() as session:
        assert stores.seen_clock(session) == SeenClock(clocks.wall, 0.0)
