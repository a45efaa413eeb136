"""One who watches a live session: gets its newest frames, as many as are read."""

import asyncio
from collections.abc import Awaitable, Callable

from starlette.websockets import WebSocket, WebSocketDisconnect

from service.stream.broadcast import Broadcast
from service.stream.errors import FINISHED, KEY_ENDED, NOT_UNDERSTOOD, SLOW_READER, End
from service.stream.sessions import Streams
from service.stream.sockets import KEY_SECONDS, close, until_one_ends

MOST_ON_THE_WAY, READ_TOGETHER = 16, 8
"""Frames that may be sent before they are read, and of how many each message of the watcher says that it has read them.

Beyond the first, frames are left out: a slow network would keep minutes of old ones in its buffers.
"""

READ_SECONDS = 60.0
"""s that a watcher may read nothing."""


async def serve(
    socket: WebSocket, streams: Streams, session_id: str, owner: str, still_may: Callable[[], Awaitable[bool]]
) -> None:
    """One who watches, while there is something to see and ``still_may`` says so."""
    try:
        with streams.watched(session_id, owner) as broadcast:
            watcher = _Watcher(socket, broadcast)
            await until_one_ends(watcher.send(), watcher.listen(), _check(still_may))
    except End as end:
        await close(socket, end.code, end.reason)
    except WebSocketDisconnect:
        return


async def _check(still_may: Callable[[], Awaitable[bool]]) -> None:
    while await still_may():
        await asyncio.sleep(KEY_SECONDS)
    raise End(KEY_ENDED, "the access key has ended, or who used it has logged out")


class _Watcher:
    def __init__(self, socket: WebSocket, broadcast: Broadcast) -> None:
        self._socket, self._broadcast = socket, broadcast
        self._on_the_way = 0
        self._read = asyncio.Event()

    async def send(self) -> None:
        """The newest frame, and again, until the session has ended; raises ``End``."""
        count = 0
        while not (self._broadcast.is_over and count == self._broadcast.count):
            count, content = await self._broadcast.newer(count)
            try:
                async with asyncio.timeout(READ_SECONDS):
                    await self._socket.send_bytes(content)
                    await self._until_read()
            except TimeoutError:
                raise End(SLOW_READER, f"nothing was read for {READ_SECONDS:g} s") from None
        raise End(FINISHED, "the session has ended")

    async def _until_read(self) -> None:
        """Wait until one more frame may be sent."""
        self._on_the_way += 1
        while self._on_the_way >= MOST_ON_THE_WAY:
            self._read.clear()
            await self._read.wait()

    async def listen(self) -> None:
        """Each message of the watcher says that it has read some frames; raises ``End`` where they were not sent."""
        while True:
            event = await self._socket.receive()
            if event["type"] == "websocket.disconnect":
                raise WebSocketDisconnect(event.get("code", 1000))
            if self._on_the_way < READ_TOGETHER - 1:  # the last may be read before its sending has returned
                raise End(NOT_UNDERSTOOD, f"a word without {READ_TOGETHER} frames to have read")
            self._on_the_way = max(self._on_the_way - READ_TOGETHER, 0)
            self._read.set()
