"""A clock that a server has looked at for long enough to believe it."""

from db.database import Database
from db.records import SeenClock
from db.repositories import stores
from db.tables import now
from service.jobs.steady_clock import STEADY


def vouch_for_the_clock(database: Database) -> None:
    """As a server has that ran for a day."""
    with database.write() as session:
        if stores.find_id(session) is None:
            stores.set_id(session, "1" * 32)
        stores.note_clock(session, SeenClock(now(), STEADY.total_seconds()))
