"""What is noted of every request that was answered: a figure for the monitor, and a record in the log."""

import asyncio
import logging
from typing import Protocol

from prometheus_client import Histogram

from service.observability import logs

logger = logging.getLogger(__name__)

LOGGED_A_SECOND = 100
"""Of requests that change nothing and went well; a record costs a third of what a look-up does. The others of a second
are counted together. Changes and errors have a record each."""

FLUSH_SECONDS = 1.0
"""s after which the others are written."""

METHODS = frozenset({"GET", "HEAD", "POST", "PUT", "PATCH", "DELETE", "OPTIONS"})
"""Any other word may be a method of HTTP, too; each would be a label."""

Kind = tuple[str, str, int]
"""Method, route and status; 0 where no answer was begun."""


class _Timer(Protocol):
    def observe(self, amount: float) -> None: ...


class AccessLog:
    """Notes requests by their route's path and not by their own.

    Names of materials are not to be labels, and what somebody wrote into an address is not to be logged.
    """

    def __init__(self, seconds: Histogram) -> None:
        self._seconds = seconds
        self._timers: dict[Kind, _Timer] = {}
        self._logged = 0
        self._second_ends: asyncio.TimerHandle | None = None
        self._others: dict[Kind, tuple[int, float]] = {}

    def record(self, method: str, route: str, status: int, seconds: float, request_id: str | None) -> None:
        """One request, answered in so many s; to be called in the event loop."""
        kind = method if method in METHODS else "other", route, status
        timer = self._timers.get(kind)
        if timer is None:
            timer = self._timers[kind] = self._seconds.labels(kind[0], route, str(status or "none"))
        timer.observe(seconds)
        if logger.isEnabledFor(logging.INFO) and not self._is_summed_up(kind, seconds):
            logger.info("answered", extra=_fields(kind, seconds, request_id=request_id))

    def flush(self) -> None:
        """Log those that had no record of their own, and begin another second."""
        if self._second_ends is not None:
            self._second_ends.cancel()
        self._second_ends, self._logged = None, 0
        others, self._others = self._others, {}
        for kind, (count, seconds) in others.items():
            logger.info("answered many", extra=_fields(kind, seconds, requests=count))

    def _is_summed_up(self, kind: Kind, seconds: float) -> bool:
        method, _, status = kind
        if method not in {"GET", "HEAD"} or not 200 <= status < 400:
            return False
        if self._second_ends is None:
            self._second_ends = asyncio.get_running_loop().call_later(FLUSH_SECONDS, self.flush)
        self._logged += 1
        if self._logged <= LOGGED_A_SECOND:
            return False
        count, total = self._others.get(kind, (0, 0.0))
        self._others[kind] = count + 1, total + seconds
        return True


def _fields(kind: Kind, seconds: float, **more: object) -> dict[str, object]:
    method, route, status = kind
    return logs.of(**more, method=method, route=route, status=status, seconds=round(seconds, 6))
