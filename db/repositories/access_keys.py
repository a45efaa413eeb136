"""Queries on access keys: only digests of them are stored."""

from sqlalchemy import exists, func, select, update
from sqlalchemy.orm import Session

from db.errors import NotFound
from db.records import AccessKey
from db.tables import AccessKeyRow, now


def add(session: Session, key_id: str, name: str, scope: str, sha256: str) -> AccessKey:
    """Store a new key's digest."""
    row = AccessKeyRow(id=key_id, name=name, scope=scope, sha256=sha256)
    session.add(row)
    session.flush()
    return _record(row)


def get(session: Session, key_id: str) -> AccessKey:
    """One key, revoked or not; raises ``NotFound``."""
    row = session.get(AccessKeyRow, key_id)
    if row is None:
        raise NotFound("access key", key_id)
    return _record(row)


def list_all(session: Session) -> list[AccessKey]:
    """Every key, oldest first, the revoked ones too."""
    return [_record(row) for row in session.scalars(select(AccessKeyRow).order_by(AccessKeyRow.created_at))]


def revoke(session: Session, key_id: str) -> AccessKey:
    """End a key's life, if that has not been done; raises ``NotFound``."""
    first_time = func.coalesce(AccessKeyRow.revoked_at, now())
    session.execute(update(AccessKeyRow).where(AccessKeyRow.id == key_id).values(revoked_at=first_time))
    return get(session, key_id)


def any_valid(session: Session) -> bool:
    """Whether some key is not revoked."""
    return bool(session.scalar(select(exists().where(AccessKeyRow.revoked_at.is_(None)))))


def _record(row: AccessKeyRow) -> AccessKey:
    return AccessKey(row.id, row.name, row.scope, row.sha256, row.created_at, row.revoked_at)  # type: ignore[arg-type]
