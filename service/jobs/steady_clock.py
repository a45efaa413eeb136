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

    Uploads go with it as it jumps ahead, since it may be right only now: none is older by that.
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
            seen = stores.seen_clock(session, lock=True)
            if seen is None:
                seen = SeenClock(at, 0.0)
            elif (jump := self._jump(seen, look, at)) is not None:
                logger.warning("the clock has jumped by %s: nothing is deleted by its age for %s", jump, STEADY)
                uploads.follow_clock(session, at, jump)
                seen = SeenClock(at, 0.0)
            else:
                seen = seen._replace(at=at, steady=seen.steady + self._passed(seen, look, at))
            stores.note_clock(session, seen)
        self._last = look
        return seen.steady >= STEADY.total_seconds()

    def _jump(self, seen: SeenClock, look: Look, at: datetime) -> timedelta | None:
        """By how much it is further than it would be; at a first look at least that. None where it is steady."""
        if self._last is None:
            jump = at - seen.at
            return None if -JUMP <= jump <= STEADY else jump
        jump = timedelta(seconds=look.ahead - self._last.ahead)
        return jump if abs(jump) > JUMP else None

    def _passed(self, seen: SeenClock, look: Look, at: datetime) -> float:
        """Seconds since somebody, here or in another process, looked."""
        if self._last is None:
            return 0.0
        return max(0.0, min(look.moment - self._last.moment, (at - seen.at).total_seconds()))


def doubt(session: Session) -> str | None:
    """Why the clock is not to be believed by a command, without a look at it for some time; None where it is."""
    seen, at = stores.seen_clock(session), now()
    if seen is not None:
        if not -JUMP <= at - seen.at <= STEADY:
            return f"{at.isoformat()}, and a server last saw {seen.at.isoformat()}"
        watched = seen.steady >= STEADY.total_seconds()
        return None if watched else f"{at.isoformat()}, and has been watched for less than a day"
    newest = uploads.newest(session)
    if newest is None or abs(at - newest) <= STEADY:
        return None
    return f"{at.isoformat()}, and the newest log is of {newest.isoformat()}"
