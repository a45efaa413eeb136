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
"""How long the clock must agree with the monotonic clock after a jump before it is believed: whoever runs the machine
has seen a wrong one by then. Also the longest time that no server may have looked at it."""

JUMP = timedelta(minutes=1)
"""Largest difference between what the two clocks advance from one look to the next."""


class Look(NamedTuple):
    """Readings of the two clocks at one moment: wall time ``at``, and the monotonic ``moment``, s."""

    at: datetime
    moment: float


class SteadyClock:
    """Compares the wall clock with the monotonic clock at each look; the database keeps over restarts for how long they
    have agreed.

    Uploads go with it as it jumps ahead, since it may be right only now: none is older by that. Where another
    process has looked meanwhile, by a clock of its own maybe, the next look is as one after a restart.
    """

    def __init__(self, database: Database) -> None:
        self._database = database
        self._last: Look | None = None

    def begin(self) -> None:
        """Note the clock where no server has looked at it yet, before anything is stored by it."""
        with self._database.write(durable=False) as session:
            if stores.seen_clock(session, lock=True) is None:
                stores.note_clock(session, SeenClock(now(), 0.0))

    def is_believed(self) -> bool:
        """Whether it has been steady for long enough while a server looked, none of them for longer than ``STEADY``
        apart.
        """
        look = Look(now(), _monotonic_seconds())
        with self._database.write(durable=False) as session:
            seen = stores.seen_clock(session, lock=True) or SeenClock(look.at, 0.0)
            last = self._last if self._last and self._last.at == seen.at else None  # else others looked meanwhile
            if last is not None and look.moment - last.moment > STEADY.total_seconds():
                last = None  # asleep, when one clock of the machine set both
            jump = _jump(seen, last, look)
            if jump is not None:
                logger.warning("the clock has jumped by %s: nothing is deleted by its age for %s", jump, STEADY)
            uploads.follow_clock(session, look.at, jump or timedelta())
            passed = 0.0 if last is None else look.moment - last.moment
            seen = SeenClock(look.at, seen.steady + passed if jump is None else 0.0)
            stores.note_clock(session, seen)
        self._last = look
        return seen.steady >= STEADY.total_seconds()


def _monotonic_seconds() -> float:
    """The monotonic clock, s: on Linux the one that goes on while the machine is asleep."""
    return time.clock_gettime(time.CLOCK_BOOTTIME) if hasattr(time, "CLOCK_BOOTTIME") else time.monotonic()


def _jump(seen: SeenClock, last: Look | None, look: Look) -> timedelta | None:
    """By how much it is further than it would be, without a last look at least that. None where it is steady."""
    if last is None:
        jump = look.at - seen.at
        return None if -JUMP <= jump <= STEADY else jump
    jump = look.at - last.at - timedelta(seconds=look.moment - last.moment)
    return jump if abs(jump) > JUMP else None


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
