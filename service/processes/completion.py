"""Cancellation of work in a thread or another process, which cannot be stopped once it has begun."""

import asyncio
from collections.abc import Awaitable
from contextlib import suppress
from typing import TypeVar

Result = TypeVar("Result")


async def run_to_completion(work: Awaitable[Result]) -> Result:
    """Await work that cannot be stopped; a cancellation, however often it comes, takes effect when the work has ended.

    So whoever awaits it keeps its turn, memory and files until then.
    """
    future = asyncio.ensure_future(work)
    try:
        return await asyncio.shield(future)
    except asyncio.CancelledError:
        while not future.done():
            with suppress(asyncio.CancelledError):
                await asyncio.wait({future})
        if not future.cancelled():
            future.exception()  # marks it as retrieved: nobody is left to raise it to
        raise
