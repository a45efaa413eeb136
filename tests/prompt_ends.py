"""Servers of uvicorn that end as soon as they are told to: the tests end hundreds.

uvicorn looks ten times a second whether it shall end, and waits a tenth more then. To look more often is no way: it
takes a fiftieth of a core for each of the servers that tests share.
"""

import asyncio
import itertools
from contextlib import suppress
from types import SimpleNamespace

import pytest
import uvicorn

BETWEEN_LOOKS = 1.0
"""s; in uvicorn a tenth, so that each look counts for ten."""


class _ShouldExit:
    """Whether a server shall end; its loop wakes when that is set."""

    def __get__(self, server: uvicorn.Server, _kind: type) -> bool:
        return bool(vars(server).get("should_exit"))

    def __set__(self, server: uvicorn.Server, value: bool) -> None:
        vars(server)["should_exit"] = value
        vars(server).get("wake", lambda: None)()


async def _main_loop(server: uvicorn.Server) -> None:
    """In place of ``uvicorn.Server.main_loop``."""
    woken, loop = asyncio.Event(), asyncio.get_running_loop()
    vars(server)["wake"] = lambda: loop.call_soon_threadsafe(woken.set)
    for looks in itertools.count(step=10):
        if await server.on_tick(looks):
            break
        with suppress(TimeoutError):
            await asyncio.wait_for(woken.wait(), BETWEEN_LOOKS)
    del vars(server)["wake"]


def patch(patched: pytest.MonkeyPatch) -> None:
    """Let all servers of this process be such ones."""
    hurried = SimpleNamespace(**vars(asyncio) | {"sleep": lambda seconds: asyncio.sleep(seconds / 20.0)})
    patched.setattr("uvicorn.server.asyncio", hurried)  # where it waits for connections to end
    patched.setattr(uvicorn.Server, "main_loop", _main_loop)
    patched.setattr(uvicorn.Server, "should_exit", _ShouldExit(), raising=False)
