"""Queries on the files of grasp logs: which may go, and which have.

A file goes in two steps, since row and blob cannot change at once: its logs are marked as ``leaving``, then the blob is
deleted and they are ``gone``. Whoever dies in between leaves the second step to the next one. What is done to one
content is done by one at a time (``lock``): an upload that brings a file back, and a step that takes it away.
"""

from collections.abc import Collection, Iterable
from datetime import datetime, timedelta
from typing import Any

from sqlalchemy import ColumnElement, Interval, Select, and_, exists, func, literal, select, text, update
from sqlalchemy.orm import Session, aliased

from db.repositories import blobs, stores
from db.tables import GraspLogRow, JobRow, now

DONE_WITH = ("done", "refused", "cancelled")
"""Ends of a job that will not read its file again; one that failed may be looked into."""


def lock(session: Session, hashes: Collection[str]) -> None:
    """Wait for others who are about the same contents, until the end of the transaction (SQLite has one writer)."""
    if session.connection().dialect.name == "postgresql":
        for key in sorted(int.from_bytes(bytes.fromhex(sha256[:16]), signed=True) for sha256 in hashes):
            session.execute(text("SELECT pg_advisory_xact_lock(:key)"), {"key": key})


def bring_back(session: Session, sha256: str) -> bool:
    """Let every log of this content, which is locked and stored again, have its file; False if none had lost it."""
    lost = (GraspLogRow.sha256 == sha256, GraspLogRow.file_state.is_not(None))
    if session.scalar(select(GraspLogRow.id).where(*lost).limit(1)) is None:
        return False
    session.execute(update(GraspLogRow).where(*lost).values(file_state=None, file_since=since(session)))
    return True


def since(session: Session) -> datetime:
    """From when a file counts as there that comes in now: no earlier than a server last saw the clock.

    It may come in by a machine whose own clock is behind.
    """
    seen = stores.seen_clock(session)
    return now() if seen is None else max(now(), seen.at)


def newest(session: Session) -> datetime | None:
    """When the last log was stored."""
    return session.scalar(select(func.max(GraspLogRow.created_at)))


def follow_clock(session: Session, at: datetime, jump: timedelta) -> None:
    """Let no file be older by a clock that has jumped to ``at``: all go ahead with it, but none is newer than that."""
    ahead, there_since = max(jump, timedelta()), GraspLogRow.file_since
    _set_since(session, there_since > at - ahead, at)
    if not ahead:
        return
    if session.connection().dialect.name == "postgresql":
        _set_since(session, there_since <= at - ahead, there_since + literal(ahead, Interval()))
    else:
        later = func.strftime("%Y-%m-%d %H:%M:%f000", there_since, f"{ahead.total_seconds():.3f} seconds")
        _set_since(session, there_since <= at - ahead, later)


def _set_since(session: Session, those: ColumnElement[bool], since: datetime | ColumnElement[Any]) -> None:
    of = (those, GraspLogRow.file_state.is_(None))
    session.execute(
        update(GraspLogRow).where(*of).values(file_since=since).execution_options(synchronize_session=False)
    )


def count_old(session: Session, before: datetime) -> tuple[int, int]:
    """How many files may go, those older than ``before`` that nothing needs, and their bytes."""
    files = _old(before).add_columns(GraspLogRow.bytes).distinct().subquery()
    count, size = session.execute(select(func.count(), func.coalesce(func.sum(files.c.bytes), 0))).one()
    return int(count), int(size)


def mark(session: Session, before: datetime, most: int) -> int:
    """Mark the logs of so many files that may go, oldest first, as ``leaving``; returns how many files these are."""
    oldest = _old(before).group_by(GraspLogRow.sha256).order_by(func.min(GraspLogRow.file_since)).limit(most)
    hashes = list(session.scalars(oldest))
    marked = update(GraspLogRow).where(GraspLogRow.sha256.in_(hashes), _may_go(GraspLogRow, before))
    session.execute(marked.values(file_state="leaving").execution_options(synchronize_session=False))
    return len(hashes)


def leaving(session: Session, most: int) -> list[str]:
    """Hashes of files that are marked."""
    query = select(GraspLogRow.sha256).where(GraspLogRow.file_state == "leaving").distinct().limit(most)
    return list(session.scalars(query))


def spare_needed(session: Session, hashes: Collection[str]) -> list[str]:
    """Those of the marked, and locked, files that may go still; a log that came since keeps its file."""
    needed = blobs.referenced(session, list(hashes))
    _set_state(session, needed, None)
    return sorted(set(hashes) - needed)


def note_gone(session: Session, hashes: Iterable[str]) -> list[tuple[str, str]]:
    """That the marked files are deleted; returns their logs, each by id and hash."""
    deleted = list(hashes)
    logs = session.execute(select(GraspLogRow.id, GraspLogRow.sha256).where(*_marked(deleted))).all()
    _set_state(session, deleted, "gone")
    return [(log_id, sha256) for log_id, sha256 in logs]


def _set_state(session: Session, hashes: Iterable[str], state: str | None) -> None:
    session.execute(update(GraspLogRow).where(*_marked(hashes)).values(file_state=state))


def _marked(hashes: Iterable[str]) -> tuple[ColumnElement[bool], ...]:
    return GraspLogRow.sha256.in_(list(hashes)), GraspLogRow.file_state == "leaving"


def _old(before: datetime) -> Select[str]:
    """Hashes of files all of whose logs may do without."""
    other = aliased(GraspLogRow)
    needs_it = (other.sha256 == GraspLogRow.sha256, other.file_state.is_(None), ~_may_go(other, before))
    return select(GraspLogRow.sha256).where(_may_go(GraspLogRow, before), ~exists().where(*needs_it))


def _may_go(log: type[GraspLogRow], before: datetime) -> ColumnElement[bool]:
    ended = exists().where(JobRow.grasp_log_id == log.id, JobRow.status.in_(DONE_WITH))
    return and_(log.file_state.is_(None), log.file_since < before, ended)
