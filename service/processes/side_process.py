"""A process beside the server that does calls one after the other, and long ones beside them.

An executor of ``concurrent.futures`` does that with two threads and two queues in the server, which for a call of
a tenth of a millisecond cost more than the call. Here it is one message each way, over a socket of the event loop.
"""

import asyncio
import pickle
import socket
import struct
import sys
import threading
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from itertools import count
from multiprocessing.context import SpawnProcess
from typing import Any, NamedTuple, TypeVar

from service.observability import logs
from service.processes import spawned
from service.processes.completion import run_to_completion

LENGTH = struct.Struct("<Q")
"""In front of every message: its bytes."""

SWITCH_SECONDS = 0.0005
"""s that a call may have to wait for another thread of the process to let go of the interpreter."""

LAST_SECONDS = 10.0
"""s that a call under way may still take once the process is to end."""

Result = TypeVar("Result")


class ProcessEnded(Exception):
    """The process is gone, and with it all that it knew."""


class _Call(NamedTuple):
    """What is told to the process; its answer has the same ``number``."""

    number: int
    is_long: bool
    do: Callable[..., Any]
    arguments: tuple[Any, ...]


class SideProcess:
    """Does what it is told, in the order in which it was told; made by ``start``.

    A call that was sent cannot be called back: who is cancelled is so once it is answered, so that whoever counts the
    calls that are under way counts it until then.
    """

    def __init__(self, process: SpawnProcess, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self._process, self._reader, self._writer = process, reader, writer
        self._asked: dict[int, asyncio.Future[Any]] = {}
        self._numbers = count()
        self._reading = asyncio.create_task(self._read())

    @classmethod
    async def start(cls) -> "SideProcess":
        """A new process."""
        ours, theirs = socket.socketpair()
        process = spawned.CONTEXT.Process(target=_work, args=(theirs, logs.current()), daemon=True)
        with theirs:
            await asyncio.to_thread(process.start)
        return cls(process, *await asyncio.open_connection(sock=ours))

    async def call(self, do: Callable[..., Result], *arguments: Any, is_long: bool = False) -> Result:
        """The result of ``do``, or what it raised; raises ``ProcessEnded``.

        Those that are long are done in a thread, one after the other, and none of the others waits for them.
        """
        if self._reading.done():
            raise ProcessEnded
        number = next(self._numbers)
        self._send(_Call(number, is_long, do, arguments))
        answer: asyncio.Future[Result] = asyncio.get_running_loop().create_future()
        self._asked[number] = answer
        return await run_to_completion(answer)

    async def stop(self) -> None:
        """End the process; what it is doing has some time left."""
        self._writer.close()
        await asyncio.to_thread(self._process.join, LAST_SECONDS)
        self._process.kill()
        await self._reading

    def _send(self, message: _Call) -> None:
        content = pickle.dumps(message, pickle.HIGHEST_PROTOCOL)
        self._writer.write(LENGTH.pack(len(content)) + content)

    async def _read(self) -> None:
        try:
            with suppress(asyncio.IncompleteReadError, OSError):
                while True:
                    (length,) = LENGTH.unpack(await self._reader.readexactly(LENGTH.size))
                    self._take(*pickle.loads(await self._reader.readexactly(length)))
        finally:
            self._writer.close()
            for answer in self._asked.values():
                if not answer.done():
                    answer.set_exception(ProcessEnded())

    def _take(self, number: int, result: Any, error: Exception | None) -> None:
        answer = self._asked.pop(number)
        if error is None:
            answer.set_result(result)
        else:
            answer.set_exception(error)


def _work(line: socket.socket, chosen: logs.Logs | None) -> None:
    """What the process does until nobody is at the other end."""
    spawned.start(chosen)
    sys.setswitchinterval(SWITCH_SECONDS)
    one_by_one = threading.Lock()

    def do(call: _Call) -> None:
        content = pickle.dumps((call.number, *_outcome(call.do, call.arguments)), pickle.HIGHEST_PROTOCOL)
        with one_by_one:
            line.sendall(LENGTH.pack(len(content)) + content)

    def end_if_it_failed(done: Future[None]) -> None:
        if done.exception() is not None:  # its answer cannot be sent, and nobody shall wait for it
            with suppress(OSError):  # whose other end may be gone
                line.shutdown(socket.SHUT_RDWR)

    with line, ThreadPoolExecutor(1, "long_calls") as long, suppress(EOFError, ConnectionError):
        while True:
            call = _receive(line)
            if call.is_long:
                long.submit(do, call).add_done_callback(end_if_it_failed)
            else:
                do(call)


def _outcome(do: Callable[..., Any], arguments: tuple[Any, ...]) -> tuple[Any, Exception | None]:
    try:
        return do(*arguments), None
    except Exception as error:  # for whoever asked
        return None, error


def _receive(line: socket.socket) -> _Call:
    (length,) = LENGTH.unpack(_exactly(line, LENGTH.size))
    call: _Call = pickle.loads(_exactly(line, length))
    return call


def _exactly(line: socket.socket, count: int) -> bytes:
    content = line.recv(count, socket.MSG_WAITALL)
    if len(content) < count:
        raise EOFError
    return content
