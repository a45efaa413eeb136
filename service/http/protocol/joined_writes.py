"""Answers that leave in one piece: their head and body reach the network together, and wake the client once."""

import asyncio
import fcntl
import math
import struct
import termios
from typing import Any

MOST_WAITING_BYTES = 64 * 1024
"""Written at once when there is more: a body of many parts is not to gather in memory."""

UNREAD_SECONDS, SLOWEST_READ = 30.0, 5_000.0
"""s between looks at whether a client reads what waits for it, and bytes/s that it must read, or it is let go: half of
the least pace of a body, for what is read shows in steps of tens of kB."""


class JoinedWrites:
    """A transport that sends together what is written to it within one turn of the event loop.

    The server writes the head of an answer and its body one after the other, each a system call that wakes whoever
    waits at the other end; of a look-up that was a third of all its time.
    """

    def __init__(self, transport: asyncio.Transport, loop: asyncio.AbstractEventLoop) -> None:
        self._transport, self._loop = transport, loop
        self._waiting: list[bytes] = []
        self._size, self._sent = 0, 0
        self._look: asyncio.TimerHandle | None = None

    def write(self, data: bytes) -> None:
        """Send soon, after what was written before."""
        if not self._waiting:
            self._loop.call_soon(self._flush)
        self._waiting.append(data)
        self._size += len(data)
        if self._size > MOST_WAITING_BYTES:
            self._flush()

    def writelines(self, parts: list[bytes]) -> None:
        """Send soon, one after the other."""
        self.write(b"".join(parts))

    def write_eof(self) -> None:
        """Send what waits, and then nothing more."""
        self._flush()
        self._transport.write_eof()

    def close(self) -> None:
        """Close once all is sent, or once the client has stopped to read it."""
        self._flush()
        self._transport.close()
        self.watch()

    def abort(self) -> None:
        """Close at once."""
        self._waiting, self._size = [], 0
        self._transport.abort()

    def get_write_buffer_size(self) -> int:
        """Bytes that are not sent yet."""
        return self._size + self._transport.get_write_buffer_size()

    def watch(self) -> None:
        """Let go a client that reads too slowly, until all is sent: what waits for it is kept for so long."""
        if self._look is None:
            self._let_go_unless_read(-math.inf)

    def _let_go_unless_read(self, least: float) -> None:
        """Look whether ``least`` bytes are read by now."""
        self._look = None
        unsent = self._transport.get_write_buffer_size()
        if unsent == 0:
            return
        read = self._sent - unsent - _unacknowledged(self._transport)
        if read < least:
            self._transport.abort()
        else:
            least = read + max(1.0, UNREAD_SECONDS * SLOWEST_READ)
            self._look = self._loop.call_later(UNREAD_SECONDS, self._let_go_unless_read, least)

    def _flush(self) -> None:
        if self._waiting:
            data, self._waiting, self._size = b"".join(self._waiting), [], 0
            if not self._transport.is_closing():  # the client may have gone since it was written
                self._sent += len(data)
                self._transport.write(data)

    def __getattr__(self, name: str) -> Any:
        """All that writes nothing is the transport's own."""
        return getattr(self._transport, name)


def _unacknowledged(transport: asyncio.Transport) -> int:
    """Bytes that the system has taken and the client's has not: of a slow reader megabytes, for minutes."""
    try:
        count = fcntl.ioctl(transport.get_extra_info("socket").fileno(), termios.TIOCOUTQ, bytes(4))
    except (AttributeError, OSError, ValueError):  # no socket, or a system that does not say
        return 0
    return int(struct.unpack("i", count)[0])
