"""The audit trail: entries are added in the transaction of the change that they record, and never changed."""

from collections.abc import Collection, Mapping
from datetime import datetime
from typing import Any

from sqlalchemy import delete, func, select
from sqlalchemy.orm import Session

from db.paging import Window, windowed
from db.records import Actor, AuditAction, AuditEntry, AuditFilter
from db.tables import AuditEntryRow, now

SERVICE = Actor("service")
"""Who does what nobody asked for: retention, and what a check of the stored files finds."""


def add(
    session: Session, actor: Actor, action: AuditAction, subject: str, details: Mapping[str, Any] | None = None
) -> None:
    """Record a change of this transaction; ``details`` is what JSON can hold."""
    where = {"address": actor.address, "request_id": actor.request_id}
    session.add(AuditEntryRow(actor=actor.name, action=action, subject=subject, details=dict(details or {}), **where))


def list_all(session: Session, window: Window, wanted: AuditFilter) -> list[AuditEntry]:
    """Entries by ``id``, which is their order."""
    query = select(AuditEntryRow)
    for name in ("actor", "action", "subject"):
        if (value := getattr(wanted, name)) is not None:
            query = query.where(getattr(AuditEntryRow, name) == value)
    return [
        _record(row) for row in session.scalars(windowed(query, window, {"id": AuditEntryRow.id}, AuditEntryRow.id))
    ]


def newest_id(session: Session) -> int:
    """Id of the newest entry; 0 where there is none."""
    return session.scalar(select(func.max(AuditEntryRow.id))) or 0


def first_between(session: Session, after: int, last: int, actions: Collection[AuditAction]) -> AuditEntry | None:
    """The first entry of some actions behind the id ``after``, up to ``last``; None where there is none."""
    query = select(AuditEntryRow).where(AuditEntryRow.id > after, AuditEntryRow.id <= last)
    row = session.scalar(query.where(AuditEntryRow.action.in_(actions)).order_by(AuditEntryRow.id).limit(1))
    return None if row is None else _record(row)


def is_recorded(session: Session, action: AuditAction, subject: str, since: datetime) -> bool:
    """Whether there is an entry of this action and subject since a moment."""
    entry = (AuditEntryRow.subject == subject, AuditEntryRow.action == action, AuditEntryRow.at >= since)
    return session.scalar(select(AuditEntryRow.id).where(*entry).limit(1)) is not None


def count_of_service(session: Session, action: AuditAction) -> int:
    """How many different subjects the service itself has recorded this of."""
    entry = (AuditEntryRow.actor == SERVICE.name, AuditEntryRow.action == action)
    return int(session.scalar(select(func.count(AuditEntryRow.subject.distinct())).where(*entry)) or 0)


def delete_before(session: Session, moment: datetime) -> int:
    """Delete the entries from before a moment, at least 30 days ago, and record that; returns how many.

    They go up to the first from after that moment, as ids tell: what follows it was made while the clock was behind.
    """
    since = select(func.min(AuditEntryRow.id)).where(AuditEntryRow.at.between(moment, now())).scalar_subquery()
    old = (AuditEntryRow.at < moment, AuditEntryRow.id < since)
    count = int(session.scalar(select(func.count()).where(*old)) or 0)
    if count:
        session.execute(delete(AuditEntryRow).where(*old))
        add(session, SERVICE, "audit.deleted", "audit", {"before": moment.isoformat(), "entries": count})
    return count


def _record(row: AuditEntryRow) -> AuditEntry:
    actor = Actor(row.actor, row.address, row.request_id)
    return AuditEntry(row.id, row.at, actor, row.action, row.subject, row.details)  # type: ignore[arg-type]
