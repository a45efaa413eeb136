"""A second process of the server, on a port of its own, in which look-ups wait for no upload."""

import asyncio
import logging
import signal
import socket
import sys
from collections.abc import Callable
from contextlib import suppress
from multiprocessing.context import SpawnProcess

import uvicorn

from service.observability import logs
from service.processes import spawned
from service.processes.side_process import SWITCH_SECONDS
from service.serving import Server, configuration, dashboard
from service.settings import Settings

logger = logging.getLogger(__name__)

RESTART_SECONDS = 1.0
"""s from the end of a process that was not told to end to the start of the next; callers wait in the socket's queue."""

LAST_SECONDS = 5.0
"""s beyond ``shutdown_seconds`` that a process may take to end."""


class LookupServer:
    """A process that serves the same data without workers, and is started anew if it is lost.

    The socket is opened here: an address that cannot be had is an ``OSError`` at once, and nobody is refused while
    the process starts.
    """

    def __init__(self, settings: Settings) -> None:
        assert settings.lookup_port is not None
        self._settings = settings.model_copy(update={"port": settings.lookup_port, "lookup_port": None, "workers": 0})
        self._socket = _listen(settings.host, settings.lookup_port)
        self._process: SpawnProcess | None = None

    @property
    def address(self) -> str:
        """Where it answers."""
        return dashboard(self._socket.getsockname())

    def start(self, is_wanted: Callable[[], bool]) -> None:
        """Begin to serve, and go on as long as that is wanted: a signal to end may reach all processes at once."""
        self._keeping = asyncio.create_task(self._keep(is_wanted))

    async def stop(self) -> None:
        """End the process once it has answered what it was asked."""
        self._keeping.cancel()
        await asyncio.wait({self._keeping})
        self._socket.close()
        process, self._process = self._process, None
        if process is None:
            return
        process.terminate()
        with suppress(TimeoutError):
            async with asyncio.timeout(self._settings.shutdown_seconds + LAST_SECONDS):
                await _end_of(process)
        process.kill()
        process.join()

    async def _keep(self, is_wanted: Callable[[], bool]) -> None:
        while is_wanted():
            try:
                await self._serve_once()
            except OSError:  # such as no memory for it now
                logger.exception("no process for look-ups could be started")
            if is_wanted():
                logger.error("the process that answers look-ups is started anew")
                await asyncio.sleep(RESTART_SECONDS)

    async def _serve_once(self) -> None:
        process = spawned.CONTEXT.Process(target=_serve, args=(self._socket, self._settings, logs.current()))
        process.start()
        self._process = process
        logger.info("look-ups are answered at %s by process %d", self.address, process.pid)
        await _end_of(process)
        logger.info("process %d, which answered look-ups, has ended", process.pid)


class ServerWithLookups(Server):
    """Has a process for look-ups beside it, from when it is ready until it has ended."""

    def __init__(self, config: uvicorn.Config, lookups: LookupServer) -> None:
        super().__init__(config)
        self._lookups = lookups

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Begin to listen; the second process finds the database as this one has made it."""
        await super().startup(sockets)
        if self.started:
            self._lookups.start(lambda: not self.should_exit)

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """End, and after that the second process."""
        try:
            await super().shutdown(sockets)
        finally:
            await self._lookups.stop()


def server_of(settings: Settings) -> Server:
    """The server, with a process for look-ups where it has a port; raises ``OSError`` for one that cannot be had."""
    if settings.lookup_port is None:
        return Server(configuration(settings))
    lookups = LookupServer(settings)
    return ServerWithLookups(configuration(settings), lookups)


def _listen(host: str, port: int) -> socket.socket:
    """A socket that listens there; raises ``OSError`` where this machine cannot."""
    try:
        family = socket.getaddrinfo(host, None, type=socket.SOCK_STREAM)[0][0]
        return socket.create_server((host, port), family=family, backlog=2048)  # as many as the server's own
    except (OSError, UnicodeError) as error:
        why = getattr(error, "strerror", None) or error
        named = f"STICTION_LOOKUP_PORT (--lookup-port) is {port}, with STICTION_HOST (--host) {host!r}"
        raise OSError(f"{named}: {why}; allowed: a free port") from error


async def _end_of(process: SpawnProcess) -> None:
    over, loop = asyncio.Event(), asyncio.get_running_loop()
    loop.add_reader(process.sentinel, over.set)
    try:
        await over.wait()
    finally:
        loop.remove_reader(process.sentinel)


def _serve(listening: socket.socket, settings: Settings, chosen: logs.Logs | None) -> None:
    """What the process does until it is told to end."""
    spawned.start(chosen)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)  # until the server heeds it
    sys.setswitchinterval(SWITCH_SECONDS)
    uvicorn.Server(configuration(settings)).run([listening])
