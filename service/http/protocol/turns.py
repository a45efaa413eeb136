"""Turns in which connections parse what they were sent, so that whoever sends much keeps the others waiting little."""

import asyncio
from collections import deque
from collections.abc import Callable
from weakref import WeakKeyDictionary

TURN_SECONDS = 0.001
"""s for which one connection parses; what is left waits until the others that have something left had their turn."""


class Turns:
    """Who waits for a turn. In one round of the event loop there is one, however many wait."""

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        self._soon = loop.call_soon
        self._waiting: deque[Callable[[], None]] = deque()

    def wait(self, go_on: Callable[[], None]) -> None:
        """Call ``go_on`` after all who wait already."""
        if not self._waiting:
            self._soon(self._next)
        self._waiting.append(go_on)

    def _next(self) -> None:
        go_on = self._waiting.popleft()
        if self._waiting:
            self._soon(self._next)
        go_on()


_TURNS: WeakKeyDictionary[asyncio.AbstractEventLoop, Turns] = WeakKeyDictionary()


def turns_of(loop: asyncio.AbstractEventLoop) -> Turns:
    """Of all connections of an event loop."""
    if loop not in _TURNS:
        _TURNS[loop] = Turns(loop)
    return _TURNS[loop]
