"""Whether the clock that dates what is stored may be believed, before anything is deleted by it."""

import logging
import time
from datetime import datetime, timedelta
from typing import NamedTuple

from sqlalchemy.orm import Session

from db.database import Database
from db.records import SeenClock
from db.repositories import stores, uploads
from db.tables import now

logger = logging.getLogger(__name__)

STEADY = timedelta(days=1)
"""For which the clock has to go as the one that nobody sets does, once it has jumped; wrong ones are seen by then. Also
how far it may go on where no server looks at it."""

JUMP = timedelta(minutes=1)
"""By which the two may part between two looks."""


class Look(NamedTuple):
    """What the clock that nobody sets said, s, and by how much the other was ahead of it, s."""

    moment: float
    ahead: float


class SteadyClock:
    """Compares the clock with the one that nobody sets, at each look; the database remembers over restarts for how long
    it was steady.

    What was stored since it last jumped is of an unknown age once it jumps again, and counts as new.
    """

    def __init__(self, database: Database) -> None:
        self._database = database
        self._last: Look | None = None

    def is_believed(self) -> bool:
        """Whether it has been steady for long enough while a server looked, none of them for longer than ``STEADY``
        apart.
        """
        at, moment = now(), time.monotonic()
        look = Look(moment, at.timestamp() - moment)
        with self._database.write(durable=False) as session:
            seen = stores.seen_clock(session)
            if seen is None or self._has_jumped(seen, look, at):
                seen = self._begin(session, seen, at)
            else:
                seen = seen._replace(at=at, steady=seen.steady + self._passed(seen, look, at))
            stores.note_clock(session, seen)
        self._last = look
        return seen.steady >= STEADY.total_seconds()

    def _has_jumped(self, seen: SeenClock, look: Look, at: datetime) -> bool:
        if self._last is None:
            return not -JUMP <= at - seen.at <= STEADY
        return abs(look.ahead - self._last.ahead) > JUMP.total_seconds()

    def _passed(self, seen: SeenClock, look: Look, at: datetime) -> float:
        """Seconds since somebody, here or in another process, looked."""
        if self._last is None:
            return 0.0
        return max(0.0, min(look.moment - self._last.moment, (at - seen.at).total_seconds()))

    def _begin(self, session: Session, seen: SeenClock | None, at: datetime) -> SeenClock:
        logger.warning("the clock says %s, which may be wrong: nothing is deleted for %s", at.isoformat(), STEADY)
        if seen is not None:
            uploads.count_as_new(session, seen.log_number, at)
        return SeenClock(at, 0.0, uploads.newest_number(session))


def doubt(session: Session) -> str | None:
    """Why the clock is not to be believed by a command, without a look at it for some time; None where it is."""
    seen, at = stores.seen_clock(session), now()
    if seen is not None:
        if not -JUMP <= at - seen.at <= STEADY:
            return f"{at.isoformat()}, and a server last saw {seen.at.isoformat()}"
        return None if seen.steady >= STEADY.total_seconds() else f"{at.isoformat()}, and has jumped lately"
    newest = uploads.newest(session)
    if newest is None or abs(at - newest) <= STEADY:
        return None
    return f"{at.isoformat()}, and the newest log is of {newest.isoformat()}"
