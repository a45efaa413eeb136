"""The turns of queued jobs, by which the queue is fair: between keys, and between the jobs of one key.

Fair queueing by virtual finish times (Demers, Keshav and Shenker, 1989): a job's turn comes a step after that of the
last job of the same key, or, where there is none, after the turn that is served now. A long job's step is longer. So
keys take turns however many jobs each has waiting, and finding the next one is a look into an index.

A second turn orders the jobs of one key in the same way by material and size. The first turn says whose job is next,
the second which of theirs.
"""

from typing import Any

from sqlalchemy import ColumnElement, false, func, select, update
from sqlalchemy.orm import InstrumentedAttribute, Session

from db.tables import JobRow

STEP, LONG_STEP = 2, 20
"""Turns from one job to the next, after a short and for a long one."""

Turn = InstrumentedAttribute[int]


def new(session: Session, key_id: str | None, material_id: int | None, *, is_long: bool) -> dict[str, int]:
    """The turns of a job that comes into the queue, by column."""
    of_key = JobRow.requested_by == key_id
    of_group = (of_key, JobRow.material_id == material_id, JobRow.is_long == is_long)
    return {
        "turn": _after(session, JobRow.turn, (), (of_key,), is_long=is_long),
        "turn_within_key": _after(session, JobRow.turn_within_key, (of_key,), of_group, is_long=is_long),
    }


def first(session: Session, *among: ColumnElement[bool]) -> tuple[str, int] | None:
    """The id of the queued job whose turn it is, and the turn that it takes, which the caller stores.

    It is locked, and passed over where another transaction has locked it.
    """
    head = _least(session, JobRow.turn, among)
    if head is None:
        return None
    chosen = _least(session, JobRow.turn_within_key, (*among, JobRow.requested_by == head.requested_by)) or head
    if chosen.id != head.id:  # it takes the turn of its key's first one, which gets its own
        session.execute(update(JobRow).where(JobRow.id == head.id).values(turn=chosen.turn))
    return str(chosen.id), int(head.turn)


def _after(
    session: Session,
    turn: Turn,
    whole: tuple[ColumnElement[bool], ...],
    group: tuple[ColumnElement[bool], ...],
    *,
    is_long: bool,
) -> int:
    """A step after the last of the group; a group that has nobody comes before the second of the others."""
    served = _served(session, turn, whole)
    if not is_long:  # short jobs may be served before long ones of an earlier turn
        served = max(served, _served(session, turn, (*whole, JobRow.is_long == false())))
    ends = [_extreme(session, func.max(turn), status, group) for status in ("queued", "running")]
    last = max((end for end in ends if end is not None), default=None)
    step = LONG_STEP if is_long else STEP
    return served + step - 1 if last is None else max(last, served) + step


def _served(session: Session, turn: Turn, among: tuple[ColumnElement[bool], ...]) -> int:
    """The turn that is served now among some jobs: that of the last one that runs and is not before its turn.

    A job that takes long may have begun in a turn long past: the next one's is at most a long step away.
    """
    head = _extreme(session, func.min(turn), "queued", among)
    in_turn = () if head is None else (turn <= head,)
    served = _extreme(session, func.max(turn), "running", (*among, *in_turn))
    if head is None:
        return served or 0
    if served is None:
        return head - STEP + 1  # who comes now comes with the head, which is older
    return max(served, head - LONG_STEP)


def _extreme(session: Session, wanted: Any, status: str, among: tuple[ColumnElement[bool], ...]) -> int | None:
    return session.scalar(select(wanted).where(JobRow.status == status, *among))


def _least(session: Session, turn: Turn, among: tuple[ColumnElement[bool], ...]) -> Any:
    query = select(JobRow.id, JobRow.requested_by, JobRow.turn).where(JobRow.status == "queued", *among)
    ordered = query.order_by(turn, JobRow.created_at, JobRow.id).limit(1).with_for_update(skip_locked=True)
    return session.execute(ordered).one_or_none()
