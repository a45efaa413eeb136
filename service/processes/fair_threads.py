"""Threads for what is done on a client's behalf, shared out fairly among those who ask.

The event loop's own few threads are left to the service itself: whatever waited there would keep everybody waiting.
"""

import asyncio
from collections.abc import Awaitable, Callable
from concurrent.futures import ThreadPoolExecutor
from contextvars import copy_context
from typing import TypeVar

from service.processes.fair_queue import PatientQueue

THREADS = 8

SHORT, LONG = 1, 3
"""Threads that work counts for: of some ms, or of seconds. Of the latter each owner has one piece at once, and all
together two, beside which there are threads for the former."""

Result = TypeVar("Result")


class FairThreads:
    """Does work in threads, of which one owner has half at most (``FairQueue``).

    Who is cancelled gives up its place; work that has begun is waited for: it has its memory and files until then.
    """

    def __init__(self) -> None:
        self._queue = PatientQueue(THREADS, "worked on")
        self._executor = ThreadPoolExecutor(THREADS, "for_clients")

    async def run(self, owner: str, do: Callable[..., Result], *arguments: object, weight: int = SHORT) -> Result:
        """The result of ``do``, or what it raised."""
        async with self._queue.turn(owner, weight):
            run = asyncio.get_running_loop().run_in_executor
            return await _to_its_end(run(self._executor, copy_context().run, do, *arguments))

    def stop(self) -> None:
        """End the threads once they have done their work."""
        self._executor.shutdown(wait=False)


async def _to_its_end(work: Awaitable[Result]) -> Result:
    future = asyncio.ensure_future(work)
    try:
        return await asyncio.shield(future)
    except asyncio.CancelledError:
        await asyncio.wait({future})
        raise
