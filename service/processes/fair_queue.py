"""Room for work that is done beside other work: so much of it at once, shared out fairly among those who ask."""

import asyncio
from collections import Counter, OrderedDict, deque
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import NamedTuple

MOST_WAITING_OF_ONE, MOST_WAITING = 32, 256
"""Who wait at most, of one owner and in all."""

WAIT_SECONDS = 30.0
"""s that anybody waits at most; clients and proxies give up after a minute, as a rule."""


class QueueFull(Exception):
    """There is no room, and too many wait for it already; the message says of whom, and for what."""


class _Waiting(NamedTuple):
    weight: int
    turn: asyncio.Future[None]


class FairQueue:
    """Room of ``capacity`` units, of which one owner has its ``share`` at most, half unless another is said.

    Owners who wait are let in one after the other, each owner's work in the order in which it came: however much one
    of them asks for, another waits for a single piece of it at most.
    """

    def __init__(self, capacity: int, what: str, share: int | None = None) -> None:
        self._free, self._share, self._what = capacity, share or max(capacity // 2, 1), what
        self._taken: Counter[str] = Counter()
        self._waiting: OrderedDict[str, deque[_Waiting]] = OrderedDict()

    @asynccontextmanager
    async def turn(self, owner: str, weight: int = 1) -> AsyncIterator[None]:
        """Room of ``weight`` units (an owner's whole share for more) until the end; raises ``QueueFull``."""
        weight = min(weight, self._share)
        await self._enter(owner, weight)
        try:
            yield
        finally:
            self._leave(owner, weight)

    async def _enter(self, owner: str, weight: int) -> None:
        waiting = _Waiting(weight, asyncio.get_running_loop().create_future())
        self._waiting.setdefault(owner, deque()).append(waiting)
        self._let_in()
        try:
            if not waiting.turn.done():
                await self._wait(owner, waiting.turn)
        except BaseException:
            self._give_up(owner, waiting)
            raise

    async def _wait(self, owner: str, turn: asyncio.Future[None]) -> None:
        self._check_length(owner)
        try:
            async with asyncio.timeout(WAIT_SECONDS):
                await turn
        except TimeoutError as error:
            raise QueueFull(f"not {self._what} within {WAIT_SECONDS:g} s") from error

    def _leave(self, owner: str, weight: int) -> None:
        self._free += weight
        self._taken[owner] -= weight
        self._taken += Counter()  # forgets who has nothing
        self._let_in()

    def _check_length(self, owner: str) -> None:
        for count, most in (
            (len(self._waiting[owner]), MOST_WAITING_OF_ONE),
            (sum(map(len, self._waiting.values())), MOST_WAITING),
        ):
            if count > most:
                raise QueueFull(f"{most} wait to be {self._what} already")

    def _give_up(self, owner: str, waiting: _Waiting) -> None:
        if waiting.turn.done() and not waiting.turn.cancelled():  # let in at the very moment
            self._leave(owner, waiting.weight)
            return
        self._remove(owner, waiting)
        self._let_in()

    def _let_in(self) -> None:
        while (owner := self._next()) is not None:
            waiting = self._waiting[owner][0]
            self._remove(owner, waiting)
            self._free -= waiting.weight
            self._taken[owner] += waiting.weight
            waiting.turn.set_result(None)

    def _next(self) -> str | None:
        """The first owner with a share left, unless there is no room for it: then nobody overtakes it."""
        for owner, (first, *_) in self._waiting.items():
            if self._taken[owner] + first.weight <= self._most(owner) and not first.turn.cancelled():
                return owner if first.weight <= self._free else None
        return None

    def _most(self, owner: str) -> int:  # noqa: ARG002  (of which it depends in others)
        """Units that an owner may have by now."""
        return self._share

    def _remove(self, owner: str, waiting: _Waiting) -> None:
        """Out of the queue; the owner's other work waits behind that of the other owners."""
        self._waiting[owner].remove(waiting)
        if self._waiting[owner]:
            self._waiting.move_to_end(owner)
        else:
            del self._waiting[owner]


class AdaptiveShareQueue(FairQueue):
    """For work that lasts as long as its owner likes, in pieces of one unit: an owner has half of what others leave.

    So there is some left for the next one, however many pieces the first few ask for and however long they keep them.
    """

    def _most(self, owner: str) -> int:
        return (self._taken[owner] + self._free + 1) // 2


class UnboundedFairQueue(FairQueue):
    """For short work of requests, of which there are no more than connections: nobody is refused."""

    async def _wait(self, owner: str, turn: asyncio.Future[None]) -> None:  # noqa: ARG002
        await turn
