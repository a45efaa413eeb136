"""From one live session to all who watch it: of the frames only the newest is kept, and packed once for all of them."""

import asyncio
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager

from service.stream.errors import TOO_MANY, End

FRAMES_A_SECOND = 30.0
"""Shown at most, however many a sensor has."""

MOST_WATCHERS, MOST_OF_ONE_OWNER = 200, 50
"""Connections that watch at once: of a server, and of one access key or of one address without a key."""


class Broadcast:
    """The newest frame of a session. ``count`` differs from one to the next; after the last one it ``is_over``."""

    def __init__(self) -> None:
        self.watchers, self.count, self.is_over = 0, 0, False
        self._newest, self._due = b"", 0.0
        self._changed = asyncio.Event()

    def wants(self, now: float) -> bool:
        """Whether a frame that comes ``now`` (s, of any clock) is to be packed: somebody watches, and it is time.

        The time since the last one may be shorter than the rest of them are apart, for frames come unevenly.
        """
        if self.watchers == 0 or now < self._due:
            return False
        period = 1.0 / FRAMES_A_SECOND
        self._due = max(self._due, now - period) + period
        return True

    def publish(self, content: bytes) -> None:
        """This is the newest frame now."""
        self._newest, self.count = content, self.count + 1
        self._changed.set()
        self._changed = asyncio.Event()

    def end(self, content: bytes) -> None:
        """This is the last that is said."""
        self.is_over = True
        self.publish(content)

    async def newer(self, count: int) -> tuple[int, bytes]:
        """The newest frame with its count, once there is one after that with this ``count``."""
        while self.count == count:
            await self._changed.wait()
        return self.count, self._newest


class Watchers:
    """How many connections watch, and whose they are."""

    def __init__(self) -> None:
        self._of_owner: Counter[str] = Counter()

    @contextmanager
    def one_more(self, owner: str, broadcast: Broadcast) -> Iterator[None]:
        """Count one of this owner while it watches; raises ``End`` where there are too many."""
        if self._of_owner.total() >= MOST_WATCHERS:
            raise End(TOO_MANY, f"{MOST_WATCHERS} connections watch")
        if self._of_owner[owner] >= MOST_OF_ONE_OWNER:
            raise End(TOO_MANY, f"{MOST_OF_ONE_OWNER} connections of this key, or of this address without one, watch")
        self._of_owner[owner] += 1
        broadcast.watchers += 1
        try:
            yield
        finally:
            broadcast.watchers -= 1
            self._of_owner[owner] -= 1
            self._of_owner += Counter()  # forgets those of whom nobody is left
