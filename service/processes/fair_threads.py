"""Threads for what is done on a client's behalf, shared out fairly among those who ask.

The event loop's own few threads are left to the service itself: whatever waited there would keep everybody waiting.
"""

import asyncio
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextvars import copy_context
from typing import TypeVar

from service.processes.completion import run_to_completion
from service.processes.fair_queue import UnboundedFairQueue

SHORT_AT_ONCE, LONG_AT_ONCE = 6, 2
"""Pieces of work that take some ms each, of which an owner has half at most, and of such as take seconds, of which each
owner has one: they wait for each other, and none of the former for any of the latter."""

Result = TypeVar("Result")


class FairThreads:
    """Does work in threads, shared out by ``FairQueue``.

    Who is cancelled gives up its place; work that has begun is waited for: it has its memory and files until then.
    """

    def __init__(self) -> None:
        self._short, self._long = (UnboundedFairQueue(many, "worked on") for many in (SHORT_AT_ONCE, LONG_AT_ONCE))
        self._executor = ThreadPoolExecutor(SHORT_AT_ONCE + LONG_AT_ONCE, "for_clients")

    async def run(self, owner: str, do: Callable[..., Result], *arguments: object, is_long: bool = False) -> Result:
        """The result of ``do``, or what it raised; ``is_long``: it may take seconds."""
        async with (self._long if is_long else self._short).turn(owner):
            run = asyncio.get_running_loop().run_in_executor
            return await run_to_completion(run(self._executor, copy_context().run, do, *arguments))

    def stop(self) -> None:
        """End the threads once they have done their work."""
        self._executor.shutdown(wait=False)
