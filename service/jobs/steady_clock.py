"""Whether the clock that dates what is stored may be believed, before anything is deleted by it."""

import logging
import math
import time
from datetime import datetime, timedelta

from db.tables import now

logger = logging.getLogger(__name__)

STEADY = timedelta(days=1)
"""For which the clock has to go as the one that nobody sets does, once it has jumped; wrong ones are seen by then."""

JUMP_SECONDS = 60.0
"""By which the two may part between two looks."""


class SteadyClock:
    """Compares the clock with the one that nobody sets, at each look.

    At the first look it is believed unless what is stored is all older than ``STEADY``.
    """

    def __init__(self) -> None:
        self._ahead: float | None = None
        self._steady_since = -math.inf

    def is_believed(self, newest: datetime | None) -> bool:
        """Whether it has not jumped lately; ``newest``: when the last log was stored, None where there is none."""
        moment = time.monotonic()
        ahead = now().timestamp() - moment
        if self._ahead is None:
            jumped = newest is not None and now() - newest > STEADY
        else:
            jumped = abs(ahead - self._ahead) > JUMP_SECONDS
        if jumped:
            self._steady_since = moment
            logger.warning(
                "the clock says %s, which may be wrong: nothing is deleted for %s", now().isoformat(), STEADY
            )
        self._ahead = ahead
        return moment - self._steady_since >= STEADY.total_seconds()
