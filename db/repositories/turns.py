"""The turns of queued jobs, by which the queue is fair: between keys, and between the jobs of one key.

Fair queueing by virtual finish times (Demers, Keshav and Shenker, 1989): a job's turn comes a step after that of the
last job of the same key, or, where there is none, after the turn that is served now. A long job's step is longer. So
keys take turns however many jobs each has waiting, and finding the next one is a look into an index.

A second turn orders the jobs of one key in the same way by material and size. The first turn says whose job is next,
the second which of theirs.
"""

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

from sqlalchemy import ColumnElement, false, func, select, update
from sqlalchemy.orm import InstrumentedAttribute, Session

from db.tables import JobRow

STEP, LONG_STEP = 2, 20
"""Turns from one job to the next, after a short and for a long one."""

Turn = InstrumentedAttribute[int]
Conditions = tuple[ColumnElement[bool], ...]


class _Line(NamedTuple):
    """Jobs that take ``turn``s among the ``whole`` of them, and the ``group`` of these that one more comes into."""

    turn: Any
    whole: Conditions
    group: Conditions


class _Extreme(NamedTuple):
    """The least or the largest turn, ``wanted``, ``among`` jobs of a ``status``."""

    wanted: Any
    status: str
    among: Conditions


def new(session: Session, key_id: str | None, material_id: int | None, *, is_long: bool) -> dict[str, int]:
    """The turns of a job that comes into the queue, by column."""
    of_key = JobRow.requested_by == key_id
    of_group = (of_key, JobRow.material_id == material_id, JobRow.is_long == is_long)
    lines = _Line(JobRow.turn, (), (of_key,)), _Line(JobRow.turn_within_key, (of_key,), of_group)
    turn, turn_within_key = _after(session, lines, is_long=is_long)
    return {"turn": turn, "turn_within_key": turn_within_key}


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


def _after(session: Session, lines: Sequence[_Line], *, is_long: bool) -> list[int]:
    """In each line a step after the last of the group; one that has nobody comes before the second of the others."""
    sizes: list[Conditions] = [()] if is_long else [(), (JobRow.is_long == false(),)]
    parts = [(line.turn, (*line.whole, *size)) for line in lines for size in sizes]  # short jobs may be served early
    heads = [_Extreme(func.min(turn), "queued", among) for turn, among in parts]
    ends = [_Extreme(func.max(line.turn), each, line.group) for line in lines for each in ("queued", "running")]
    found = _extremes(session, *heads, *ends)
    served, last = list(_served(session, parts, found[: len(parts)])), found[len(parts) :]
    step, after = LONG_STEP if is_long else STEP, []
    for k in range(len(lines)):
        now = max(served[k * len(sizes) : (k + 1) * len(sizes)])
        known = [end for end in last[2 * k : 2 * k + 2] if end is not None]
        after.append(max(now, *known) + step if known else now + step - 1)
    return after


def _served(session: Session, parts: Sequence[tuple[Any, Conditions]], heads: Sequence[int | None]) -> Iterator[int]:
    """The turns that are served now among some jobs, whose queued ones begin with the ``heads``: that of the last one
    that runs and is not before its turn.

    A job that takes long may have begun in a turn long past: the next one's is at most a long step away.
    """
    running = [
        _Extreme(func.max(turn), "running", among if head is None else (*among, turn <= head))
        for (turn, among), head in zip(parts, heads, strict=True)
    ]
    for head, served in zip(heads, _extremes(session, *running), strict=True):
        if head is None:
            yield served or 0
        elif served is None:
            yield head - STEP + 1  # who comes now comes with the head, which is older
        else:
            yield max(served, head - LONG_STEP)


def _extremes(session: Session, *asked: _Extreme) -> list[int | None]:
    """All by one statement, each of which is a look into an index."""
    each = [select(one.wanted).where(JobRow.status == one.status, *one.among).scalar_subquery() for one in asked]
    return list(session.execute(select(*each)).one())


def _least(session: Session, turn: Turn, among: tuple[ColumnElement[bool], ...]) -> Any:
    query = select(JobRow.id, JobRow.requested_by, JobRow.turn).where(JobRow.status == "queued", *among)
    ordered = query.order_by(turn, JobRow.created_at, JobRow.id).limit(1).with_for_update(skip_locked=True)
    return session.execute(ordered).one_or_none()
