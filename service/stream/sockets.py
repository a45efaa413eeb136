"""What the connections of the live stream have in common: parts that go on at once, and how a socket is closed."""

import asyncio
from collections.abc import Coroutine
from typing import Any

from starlette.websockets import WebSocket, WebSocketDisconnect

KEY_SECONDS = 2.0
"""s between looks at the key of a connection: so long one that has ended may still be used."""


async def until_one_ends(*parts: Coroutine[Any, Any, None]) -> None:
    """Do them at once until one of them ends or raises, and end the others."""
    tasks = [asyncio.create_task(part) for part in parts]
    try:
        done, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        done.pop().result()
    finally:
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)


async def close(socket: WebSocket, code: int, reason: str) -> None:
    """Close with as much of the reason as a close frame holds."""
    try:
        await socket.close(code, reason.encode()[:120].decode(errors="ignore"))
    except (RuntimeError, WebSocketDisconnect):  # it is closed already
        return
