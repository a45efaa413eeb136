"""Queries on runners: the processes that have jobs done. A runner says by its beats that it lives."""

import uuid

from sqlalchemy import delete, select, update
from sqlalchemy.orm import Session

from db.records import Runner
from db.repositories import jobs
from db.tables import RunnerRow


def add(session: Session, name: str) -> str:
    """Make a runner known and return its id, which no other ever has."""
    row = RunnerRow(id=uuid.uuid4().hex, name=name)
    session.add(row)
    session.flush()
    return row.id


def beat(session: Session, runner_id: str) -> bool:
    """Say that a runner lives; False if it was taken for dead, and its jobs were given to others."""
    return bool(
        session.execute(
            update(RunnerRow)
            .where(RunnerRow.id == runner_id)
            .values(beats=RunnerRow.beats + 1)
            .returning(RunnerRow.beats)
        ).all()
    )


def list_all(session: Session) -> list[Runner]:
    """Every runner that is not known to be dead, oldest first."""
    rows = session.scalars(select(RunnerRow).order_by(RunnerRow.started_at, RunnerRow.id))
    return [Runner(row.id, row.name, row.beats, row.started_at) for row in rows]


def remove(session: Session, runner_id: str) -> list[str]:
    """Take a runner that has ended or is dead off, and put its jobs back into the queue; returns their ids.

    Nothing happens where another has done it.
    """
    if session.scalar(select(RunnerRow.id).where(RunnerRow.id == runner_id).with_for_update()) is None:
        return []
    released = jobs.release_all(session, runner_id)
    session.execute(delete(RunnerRow).where(RunnerRow.id == runner_id))
    return released
