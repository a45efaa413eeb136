"""A process beside the server that does calls one after the other.

An executor of ``concurrent.futures`` does that with two threads and two queues in the server, which for a call of
a tenth of a millisecond cost more than the call. Here it is one message each way, over a socket of the event loop.
"""

import asyncio
import pickle
import socket
import struct
import sys
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from multiprocessing.context import SpawnProcess
from typing import Any, TypeVar

from service.observability import logs
from service.processes import spawned

LENGTH = struct.Struct("<Q")
"""In front of every message: its bytes."""

SWITCH_SECONDS = 0.0005
"""s that a call may have to wait for another thread of the process to let go of the interpreter."""

LAST_SECONDS = 10.0
"""s that a call under way may still take once the process is to end."""

Result = TypeVar("Result")


class ProcessEnded(Exception):
    """The process is gone, and with it all that it knew."""


class SideProcess:
    """Does what it is told, in the order in which it was told; made by ``start``."""

    def __init__(self, process: SpawnProcess, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self._process, self._reader, self._writer = process, reader, writer
        self._asked: deque[asyncio.Future[Any]] = deque()
        self._reading = asyncio.create_task(self._read())

    @classmethod
    async def start(cls) -> "SideProcess":
        """A new process."""
        ours, theirs = socket.socketpair()
        process = spawned.CONTEXT.Process(target=_work, args=(theirs, logs.current()), daemon=True)
        with theirs:
            await asyncio.to_thread(process.start)
        return cls(process, *await asyncio.open_connection(sock=ours))

    async def call(self, do: Callable[..., Result], *arguments: Any) -> Result:
        """The result of ``do``, or what it raised; raises ``ProcessEnded``."""
        if self._reading.done():
            raise ProcessEnded
        self._send((do, arguments))
        answer: asyncio.Future[Result] = asyncio.get_running_loop().create_future()
        self._asked.append(answer)
        return await answer

    async def stop(self) -> None:
        """End the process; what it is doing has some time left."""
        self._writer.close()
        await asyncio.to_thread(self._process.join, LAST_SECONDS)
        self._process.kill()
        await self._reading

    def _send(self, message: Any) -> None:
        content = pickle.dumps(message, pickle.HIGHEST_PROTOCOL)
        self._writer.write(LENGTH.pack(len(content)) + content)

    async def _read(self) -> None:
        with suppress(asyncio.IncompleteReadError, OSError):
            while True:
                (length,) = LENGTH.unpack(await self._reader.readexactly(LENGTH.size))
                result, error = pickle.loads(await self._reader.readexactly(length))
                answer = self._asked.popleft()
                if answer.done():  # nobody waits for it any more
                    continue
                if error is None:
                    answer.set_result(result)
                else:
                    answer.set_exception(error)
        self._writer.close()
        for answer in self._asked:
            if not answer.done():
                answer.set_exception(ProcessEnded())


def _work(line: socket.socket, chosen: logs.Logs | None) -> None:
    """What the process does until nobody is at the other end."""
    spawned.start(chosen)
    sys.setswitchinterval(SWITCH_SECONDS)
    with line, suppress(EOFError, ConnectionError):
        while True:
            do, arguments = _receive(line)
            content = pickle.dumps(_outcome(do, arguments), pickle.HIGHEST_PROTOCOL)
            line.sendall(LENGTH.pack(len(content)) + content)


def _outcome(do: Callable[..., Any], arguments: tuple[Any, ...]) -> tuple[Any, Exception | None]:
    try:
        return do(*arguments), None
    except Exception as error:  # for whoever asked
        return None, error


def _receive(line: socket.socket) -> Any:
    (length,) = LENGTH.unpack(_exactly(line, LENGTH.size))
    return pickle.loads(_exactly(line, length))


def _exactly(line: socket.socket, count: int) -> bytes:
    content = line.recv(count, socket.MSG_WAITALL)
    if len(content) < count:
        raise EOFError
    return content
