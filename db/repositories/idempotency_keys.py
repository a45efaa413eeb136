"""Queries on idempotency keys: which answer was given under one already."""

from collections.abc import Mapping
from datetime import timedelta
from typing import Any

from sqlalchemy import delete, insert, select, tuple_, update
from sqlalchemy.exc import IntegrityError
from sqlalchemy.orm import Session

from db.defaults import EXPIRED_KEYS_PER_CLAIM
from db.errors import AlreadyExists
from db.tables import IdempotencyKeyRow, now


def claim(session: Session, owner: str, key: str, fingerprint: str, lifetime: timedelta) -> dict[str, Any] | None:
    """Take a key for this transaction, or get the answer that was given under it.

    Another transaction that has the key is waited for. Raises ``AlreadyExists`` where another ``fingerprint`` has it.
    Keys older than ``lifetime`` are forgotten.
    """
    _forget(session, lifetime)
    limit = now() - lifetime
    of_it = (IdempotencyKeyRow.owner == owner, IdempotencyKeyRow.key == key)
    session.execute(delete(IdempotencyKeyRow).where(*of_it, IdempotencyKeyRow.created_at < limit))
    try:
        with session.begin_nested():
            row = {"owner": owner, "key": key, "fingerprint": fingerprint, "answer": {}}
            session.execute(insert(IdempotencyKeyRow).values(**row))
    except IntegrityError:  # names the key, so nothing is raised from it: what fails below may be logged
        pass
    else:
        return None
    earlier = session.execute(select(IdempotencyKeyRow.fingerprint, IdempotencyKeyRow.answer).where(*of_it)).one()
    if earlier.fingerprint != fingerprint:
        raise AlreadyExists("idempotency key", key)
    answer: dict[str, Any] = earlier.answer
    return answer


def find(session: Session, owner: str, key: str, lifetime: timedelta) -> tuple[str, dict[str, Any]] | None:
    """The fingerprint of what was asked under a key, and its answer; None of a key that is not known."""
    of_it = (IdempotencyKeyRow.owner == owner, IdempotencyKeyRow.key == key)
    counts = IdempotencyKeyRow.created_at >= now() - lifetime
    row = session.execute(select(IdempotencyKeyRow.fingerprint, IdempotencyKeyRow.answer).where(*of_it, counts)).first()
    return None if row is None else (row.fingerprint, row.answer)


def keep(session: Session, owner: str, key: str, answer: Mapping[str, Any]) -> None:
    """Store the answer of a key that this transaction has claimed."""
    of_it = (IdempotencyKeyRow.owner == owner, IdempotencyKeyRow.key == key)
    session.execute(update(IdempotencyKeyRow).where(*of_it).values(answer=dict(answer)))


def release(session: Session, owner: str, key: str) -> None:
    """Give a key back that this transaction has claimed."""
    session.execute(delete(IdempotencyKeyRow).where(IdempotencyKeyRow.owner == owner, IdempotencyKeyRow.key == key))


def _forget(session: Session, lifetime: timedelta) -> None:
    """Remove some old keys, none that another transaction is about: two must not wait for each other."""
    columns = (IdempotencyKeyRow.owner, IdempotencyKeyRow.key)
    old = select(*columns).where(IdempotencyKeyRow.created_at < now() - lifetime).limit(EXPIRED_KEYS_PER_CLAIM)
    found = [tuple(row) for row in session.execute(old.with_for_update(skip_locked=True))]
    if found:
        session.execute(delete(IdempotencyKeyRow).where(tuple_(*columns).in_(found)))
