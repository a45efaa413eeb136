"""Queries on access keys: only digests of them are stored."""

from datetime import datetime

from sqlalchemy import exists, func, or_, select, update
from sqlalchemy.orm import Session

from db.errors import NotFound
from db.records import AccessKey, Scope
from db.tables import AccessKeyRow, now


def add(
    session: Session,
    key_id: str,
    name: str,
    scope: str,
    sha256: str,
    *,
    expires_at: datetime | None = None,
    group: str | None = None,
) -> AccessKey:
    """Store a new key's digest."""
    row = AccessKeyRow(id=key_id, name=name, scope=scope, sha256=sha256, expires_at=expires_at, group=group)
    session.add(row)
    session.flush()
    return _record(row)


def get(session: Session, key_id: str) -> AccessKey:
    """One key, valid or not; raises ``NotFound``."""
    row = session.get(AccessKeyRow, key_id)
    if row is None:
        raise NotFound("access key", key_id)
    return _record(row)


def list_all(session: Session) -> list[AccessKey]:
    """Every key, oldest first, the revoked and expired ones too."""
    return [_record(row) for row in session.scalars(select(AccessKeyRow).order_by(AccessKeyRow.created_at))]


def revoke(session: Session, key_id: str) -> AccessKey:
    """End a key's life, if that has not been done; raises ``NotFound``."""
    first_time = func.coalesce(AccessKeyRow.revoked_at, now())
    session.execute(update(AccessKeyRow).where(AccessKeyRow.id == key_id).values(revoked_at=first_time))
    return get(session, key_id)


def lock(session: Session, key_id: str) -> None:
    """Make others that lock the key wait for this transaction (SQLite has one writer anyway).

    Rows that refer to the key may come in meanwhile.
    """
    session.execute(select(AccessKeyRow.id).where(AccessKeyRow.id == key_id).with_for_update(key_share=True))


def any_valid(session: Session) -> bool:
    """Whether some key is neither revoked nor expired."""
    is_live = or_(AccessKeyRow.expires_at.is_(None), AccessKeyRow.expires_at > now())
    return bool(session.scalar(select(exists().where(AccessKeyRow.revoked_at.is_(None), is_live))))


def _record(row: AccessKeyRow) -> AccessKey:
    scope: Scope = row.scope  # type: ignore[assignment]  # the database checks it
    times = row.created_at, row.revoked_at, row.expires_at
    return AccessKey(row.id, row.name, scope, row.sha256, *times, row.group)
