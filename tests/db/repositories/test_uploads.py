"""Which files may go, at moments that are set by hand."""

from collections.abc import Callable
from datetime import UTC, datetime, timedelta

import pytest
from sqlalchemy import select, update
from sqlalchemy.orm import Session

from db.database import Database
from db.records import NewGraspLog, SeenClock
from db.repositories import grasp_logs, jobs, stores, uploads
from db.tables import GraspLogRow, JobRow, now

Make = Callable[..., NewGraspLog]
BEFORE = datetime(2026, 3, 1, 12, 0, tzinfo=UTC)
SECOND = timedelta(seconds=1)
HASHES = [f"{letter * 64}" for letter in "abc"]


def store(session: Session, log: NewGraspLog, since: datetime = BEFORE - SECOND, status: str = "done") -> str:
    """A log whose file is there since a moment, and whose job has ended so."""
    log_id = grasp_logs.add(session, log)
    job_id = jobs.add(session, "ingest", "ols", material_id=log.material_id, grasp_log_id=log_id)
    session.execute(update(GraspLogRow).where(GraspLogRow.id == log_id).values(file_since=since))
    ended = None if status in {"queued", "running"} else now()
    reason = "because" if status in {"failed", "refused", "cancelled"} else None
    session.execute(update(JobRow).where(JobRow.id == job_id).values(status=status, finished_at=ended, reason=reason))
    return log_id


def states(session: Session) -> list[str | None]:
    return list(session.scalars(select(GraspLogRow.file_state).order_by(GraspLogRow.number)))


@pytest.mark.parametrize(("late", "goes"), [(-SECOND, True), (timedelta(0), False), (SECOND, False)])
def test_a_file_goes_that_is_older_than_the_moment(
    database: Database, new_log: Make, late: timedelta, goes: bool
) -> None:
    with database.write() as session:
        store(session, new_log(), BEFORE + late)
        assert uploads.count_old(session, BEFORE) == (int(goes), 10 * goes)
        assert uploads.mark(session, BEFORE, 5) == goes
        assert states(session) == ["leaving" if goes else None]
        assert uploads.count_old(session, BEFORE) == (0, 0)


@pytest.mark.parametrize(
    ("status", "goes"), [("done", True), ("refused", True), ("cancelled", True), ("failed", False), ("queued", False)]
)
def test_a_file_goes_once_no_job_will_read_it(database: Database, new_log: Make, status: str, goes: bool) -> None:
    with database.write() as session:
        store(session, new_log(), status=status)
        assert uploads.mark(session, BEFORE, 5) == goes


@pytest.mark.parametrize("other", ["younger", "unfinished"])
def test_a_file_stays_while_another_log_of_it_needs_it(database: Database, new_log: Make, other: str) -> None:
    with database.write() as session:
        store(session, new_log(sha256=HASHES[0]))
        since, status = (BEFORE, "done") if other == "younger" else (BEFORE - SECOND, "queued")
        store(session, new_log(sha256=HASHES[0], detector="filter"), since, status)
        assert uploads.count_old(session, BEFORE) == (0, 0)
        assert uploads.mark(session, BEFORE, 5) == 0
        assert states(session) == [None, None]


def test_logs_of_one_file_are_one_file_that_goes_for_all_of_them(database: Database, new_log: Make) -> None:
    with database.write() as session:
        ids = [store(session, new_log(sha256=HASHES[0], detector=name)) for name in ("filter", "strain_rate")]
        store(session, new_log(sha256=HASHES[1]))
        assert uploads.count_old(session, BEFORE) == (2, 20)
        assert uploads.mark(session, BEFORE, 1) == 1
        assert uploads.leaving(session, 5) == [HASHES[0]]
        assert sorted(uploads.note_gone(session, [HASHES[0]])) == sorted((log_id, HASHES[0]) for log_id in ids)
        assert states(session) == ["gone", "gone", None]


def test_the_oldest_files_go_first_and_no_more_than_asked_for(database: Database, new_log: Make) -> None:
    with database.write() as session:
        for days, sha256 in zip((1, 3, 2), HASHES, strict=True):
            store(session, new_log(sha256=sha256), BEFORE - timedelta(days=days))
        assert uploads.mark(session, BEFORE, 2) == 2
        assert states(session) == [None, "leaving", "leaving"]
        assert sorted(uploads.leaving(session, 5)) == sorted(HASHES[1:])
        assert len(uploads.leaving(session, 1)) == 1


def test_only_what_is_marked_is_gone(database: Database, new_log: Make) -> None:
    with database.write() as session:
        store(session, new_log(sha256=HASHES[0]))
        assert uploads.note_gone(session, HASHES) == []
        assert states(session) == [None]


def test_a_marked_file_that_a_newer_log_refers_to_is_spared(database: Database, new_log: Make) -> None:
    with database.write() as session:
        for sha256 in HASHES[:2]:
            store(session, new_log(sha256=sha256))
        uploads.mark(session, BEFORE, 5)
        store(session, new_log(sha256=HASHES[0], detector="filter"), BEFORE)
        assert uploads.spare_needed(session, HASHES[:2]) == [HASHES[1]]
        assert states(session) == [None, "leaving", None]


@pytest.mark.parametrize("state", ["leaving", "gone"])
def test_a_file_that_comes_again_is_back_for_all_of_its_logs(database: Database, new_log: Make, state: str) -> None:
    with database.write() as session:
        for name in ("filter", "strain_rate"):
            store(session, new_log(sha256=HASHES[0], detector=name))
        store(session, new_log(sha256=HASHES[1]))
        assert not uploads.bring_back(session, HASHES[0])
        session.execute(update(GraspLogRow).values(file_state=state))
        begin = now()
        assert uploads.bring_back(session, HASHES[0])
        assert states(session) == [None, None, state]
        since = session.scalars(select(GraspLogRow.file_since).where(GraspLogRow.file_state.is_(None))).all()
        assert all(begin <= moment <= now() for moment in since)


def test_a_file_is_there_since_no_earlier_than_the_clock_was_seen(database: Database) -> None:
    with database.write() as session:
        stores.set_id(session, "1" * 32)
        assert now() - SECOND < uploads.since(session) <= now()
        ahead = now() + timedelta(days=9)
        stores.note_clock(session, SeenClock(ahead, 5.0))
        assert uploads.since(session) == ahead
        stores.note_clock(session, SeenClock(BEFORE, 5.0))
        assert now() - SECOND < uploads.since(session) <= now()


def test_the_newest_log_is_the_one_that_was_stored_last(database: Database, new_log: Make) -> None:
    with database.write() as session:
        assert uploads.newest(session) is None
        for days in (0, 5, 3):
            log_id = store(session, new_log())
            at = BEFORE + timedelta(days=days)
            session.execute(update(GraspLogRow).where(GraspLogRow.id == log_id).values(created_at=at))
        assert uploads.newest(session) == BEFORE + timedelta(days=5)


@pytest.mark.parametrize("jump", [timedelta(days=2, milliseconds=250), timedelta(days=-2), timedelta(0)])
def test_files_go_ahead_with_a_clock_that_jumps_but_none_beyond_it(
    database: Database, new_log: Make, jump: timedelta
) -> None:
    ahead = max(jump, timedelta(0))
    with database.write() as session:
        for days in (-30, -2, -1, 4):
            store(session, new_log(), BEFORE + timedelta(days=days))
        store(session, new_log(sha256=HASHES[0]), BEFORE - timedelta(days=30))
        session.execute(update(GraspLogRow).where(GraspLogRow.sha256 == HASHES[0]).values(file_state="gone"))
        uploads.follow_clock(session, BEFORE, jump)
        found = list(session.scalars(select(GraspLogRow.file_since).order_by(GraspLogRow.number)))
    moved = [min(BEFORE + timedelta(days=days) + ahead, BEFORE) for days in (-30, -2, -1, 4)]
    assert found == [*moved, BEFORE - timedelta(days=30)]
