"""Queries on sessions of browsers: only digests of their tokens are stored, and none outlives its access key."""

from datetime import datetime

from sqlalchemy import delete, select
from sqlalchemy.orm import Session

from db.records import AccessKey
from db.repositories import access_keys
from db.tables import BrowserSessionRow, now


def add(session: Session, sha256: str, key_id: str, expires_at: datetime) -> None:
    """Store a session; those that have expired, anybody's, go."""
    session.execute(delete(BrowserSessionRow).where(BrowserSessionRow.expires_at <= now()))
    session.add(BrowserSessionRow(sha256=sha256, key_id=key_id, expires_at=expires_at))
    session.flush()


def keep_newest(session: Session, key_id: str, most: int) -> None:
    """End all sessions of a key but those that were begun last."""
    newest_first = (BrowserSessionRow.created_at.desc(), BrowserSessionRow.sha256)
    of_key = select(BrowserSessionRow.sha256).where(BrowserSessionRow.key_id == key_id)
    oldest = list(session.scalars(of_key.order_by(*newest_first).offset(most)))
    session.execute(delete(BrowserSessionRow).where(BrowserSessionRow.sha256.in_(oldest)))


def find_key(session: Session, sha256: str) -> AccessKey | None:
    """The access key, valid or not, of a session that has not expired; None where there is no such session."""
    is_it = (BrowserSessionRow.sha256 == sha256, BrowserSessionRow.expires_at > now())
    key_id = session.scalar(select(BrowserSessionRow.key_id).where(*is_it))
    return None if key_id is None else access_keys.get(session, key_id)


def remove(session: Session, sha256: str) -> None:
    """End a session, if it is there."""
    session.execute(delete(BrowserSessionRow).where(BrowserSessionRow.sha256 == sha256))
