"""Work that has begun elsewhere, in a thread or in another process, and cannot be called back."""

import asyncio
from collections.abc import Awaitable
from contextlib import suppress
from typing import TypeVar

Result = TypeVar("Result")


async def to_its_end(work: Awaitable[Result]) -> Result:
    """The result of work, or what it raised; who is cancelled, however often, is so once the work has ended.

    Until then it has its turn, its memory and its files.
    """
    future = asyncio.ensure_future(work)
    try:
        return await asyncio.shield(future)
    except asyncio.CancelledError:
        while not future.done():
            with suppress(asyncio.CancelledError):
                await asyncio.wait({future})
        if not future.cancelled():
            future.exception()  # nobody is there to be told
        raise
