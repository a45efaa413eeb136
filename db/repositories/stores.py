"""The id of the store that the database belongs to."""

from sqlalchemy import inspect, select, text, update
from sqlalchemy.orm import Session

from db.errors import StorageUnavailable
from db.records import SeenClock
from db.tables import StoreRow


def lock(session: Session) -> None:
    """Let others who would give the database an id wait until the end of the transaction (SQLite has one writer)."""
    if session.connection().dialect.name == "postgresql":
        session.execute(text("SELECT pg_advisory_xact_lock(hashtext('stiction store'))"))


def has_table(session: Session) -> bool:
    """Whether the database's schema has store ids yet."""
    return inspect(session.connection()).has_table(StoreRow.__tablename__)


def find_id(session: Session) -> str | None:
    """The database's store id; None where it has none yet."""
    return session.scalar(select(StoreRow.id))


def set_id(session: Session, store_id: str) -> None:
    """Give the database this store id."""
    session.merge(StoreRow(number=1, id=store_id))


def webhook_entry(session: Session) -> int | None:
    """Id of the newest entry of the audit trail that the webhook has had; None where there never was a webhook."""
    return session.scalar(select(StoreRow.webhook_entry_id))


def set_webhook_entry(session: Session, entry_id: int, before: int | None) -> None:
    """Note that the webhook has had the entries up to this one; not where another process has noted more than
    ``before`` meanwhile.
    """
    session.execute(
        update(StoreRow).where(StoreRow.webhook_entry_id.is_not_distinct_from(before)).values(webhook_entry_id=entry_id)
    )


def seen_clock(session: Session, *, lock: bool = False) -> SeenClock | None:
    """The clock as a server last looked at it; None where none has. ``lock``: others note it after this transaction."""
    row = session.scalar(select(StoreRow).with_for_update() if lock else select(StoreRow))
    if row is None or row.clock_seen_at is None:
        return None
    return SeenClock(row.clock_seen_at, row.clock_steady_seconds or 0.0)


def note_clock(session: Session, seen: SeenClock) -> None:
    """Note how the clock was seen. Raises ``StorageUnavailable`` where the database has no store id."""
    noted = update(StoreRow).values(clock_seen_at=seen.at, clock_steady_seconds=seen.steady)
    if session.scalar(noted.returning(StoreRow.number)) is None:
        raise StorageUnavailable("the database has no store id, beside which the clock is noted; allowed: a restart")


def touch(session: Session) -> None:
    """Write the row anew: it shows whether the database takes anything."""
    session.execute(update(StoreRow).values(number=1))


def require(session: Session, store_id: str | None) -> None:
    """Make sure, inside a transaction, that the database is still the one that was opened; None: it had no id.

    Raises ``StorageUnavailable``.
    """
    found = find_id(session)
    if store_id is not None and found != store_id:
        raise StorageUnavailable(
            f"database: its store id was {store_id} and is {found}: another database is in its place; allowed: the "
            "first one, or a restart"
        )
