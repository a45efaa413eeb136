"""Sessions of the live stream, their bounds, and the worker process that has their detectors."""

import asyncio
import uuid
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any, TypeVar

import msgspec

from service.processes.side_process import ProcessEnded, SideProcess
from service.stream import detectors
from service.stream.messages import Open, packed

MOST_SESSIONS = 200
PATIENCE = 60.0
"""s that a session waits for its client to come back, and a new connection may take to say what it wants."""

ANSWERS_KEPT, ANSWER_BYTES_KEPT = 256, 256 * 1024
"""Answers that a client who comes back may have missed; fewer where many elements slip."""

FINISHED, NOT_UNDERSTOOD, DETECTOR_LOST = 1000, 1003, 1011
KEY_ENDED, UNKNOWN_SESSION, SLOW_READER, IN_USE = 4401, 4404, 4408, 4409
REFUSED, TOO_MANY, STORAGE_AWAY = 4422, 4429, 4503

Result = TypeVar("Result")


class End(Exception):
    """The connection is to be closed, with this code and reason."""

    def __init__(self, code: int, reason: str) -> None:
        super().__init__(reason)
        self.code, self.reason = code, reason


class RecentAnswers:
    """The last answers, packed, for a client who comes back."""

    def __init__(self) -> None:
        self._packed: deque[tuple[int, bytes]] = deque()
        self._bytes = 0

    def add(self, answer: dict[str, Any]) -> None:
        """Keep one, and forget the oldest beyond the bounds."""
        content = msgspec.msgpack.encode(answer)
        self._packed.append((answer["number"], content))
        self._bytes += len(content)
        while len(self._packed) > ANSWERS_KEPT or self._bytes > ANSWER_BYTES_KEPT:
            self._bytes -= len(self._packed.popleft()[1])

    def after(self, number: int) -> list[dict[str, Any]]:
        """Those of later frames."""
        return [msgspec.msgpack.decode(content) for each, content in self._packed if each > number]


@dataclass(slots=True)
class Session:
    """What the server knows of a session; the detector is in the worker. ``owner`` is whose quota it counts in."""

    id: str
    opening: Open
    key_id: str | None
    owner: str
    next: int = 0
    recent: RecentAnswers = field(default_factory=RecentAnswers)
    connected: bool = False
    expiry: asyncio.TimerHandle | None = None


class Streams:
    """All sessions, and the worker process of their detectors, started with the first of them.

    An owner, which is an access key or else an address, has at most ``per_owner`` of them, and what they keep has at
    most ``most_bytes`` together.
    """

    def __init__(self, per_owner: int = 50, most_bytes: int = 512 * 2**20) -> None:
        self._per_owner, self._most_bytes = per_owner, most_bytes
        self._process: SideProcess | None = None
        self._starting = asyncio.Lock()
        self._sessions: dict[str, Session] = {}
        self._dropping: set[asyncio.Task[None]] = set()

    async def open(self, opening: Open, key_id: str | None, address: str) -> Session:
        """A new session; raises ``InvalidInput`` for what cannot be a sensor, ``End`` where there are too many."""
        session = Session(uuid.uuid4().hex, opening, key_id, key_id or f"address {address}")
        self._check_room(session.owner)
        position, opening.position = packed("position", opening.position), b""
        self._sessions[session.id] = session  # before it is there, so that others who open one meanwhile count it
        try:
            await self.call(
                detectors.open_session, session.id, position, opening.grid, opening.element_area, opening.detector,
                opening.keep, self._most_bytes,
            )  # fmt: skip
        except BaseException:
            self._forget(session)
            raise
        self.leave(session)
        return session

    def _check_room(self, owner: str) -> None:
        if len(self._sessions) >= MOST_SESSIONS:
            raise End(TOO_MANY, f"{MOST_SESSIONS} sessions are open")
        if sum(each.owner == owner for each in self._sessions.values()) >= self._per_owner:
            raise End(TOO_MANY, f"{self._per_owner} sessions of this key, or of this address without one, are open")

    def join(self, session: Session) -> None:
        """A connection carries the session from now on."""
        session.connected = True
        if session.expiry is not None:
            session.expiry.cancel()

    def leave(self, session: Session) -> None:
        """No connection does; the session is forgotten unless there is one in time."""
        session.connected = False
        if session.id in self._sessions:
            session.expiry = asyncio.get_running_loop().call_later(PATIENCE, self._forget, session)

    def find(self, name: str, key_id: str | None) -> Session:
        """The session to go on with, of the same key; raises ``End``."""
        session = self._sessions.get(name)
        if session is None or session.key_id != key_id:
            raise End(UNKNOWN_SESSION, "no such session, or it waited too long")
        if session.connected:
            raise End(IN_USE, "the session has a connection already")
        return session

    async def end(self, session: Session) -> None:
        """Forget a session."""
        if self._sessions.pop(session.id, None) is not None:
            await self.call(detectors.drop, session.id)

    def _forget(self, session: Session) -> None:
        """The same at once, with the detector dropped soon after."""
        if self._sessions.pop(session.id, None) is not None and self._process is not None:
            task = asyncio.create_task(self._drop(session.id))
            self._dropping.add(task)
            task.add_done_callback(self._dropping.discard)

    async def _drop(self, name: str) -> None:
        with suppress(End):  # the process ended, and every session with it
            await self.call(detectors.drop, name)

    async def call(self, do: Callable[..., Result], *arguments: Any) -> Result:
        """Do something in the worker; raises ``End`` where it died, and all detectors with it."""
        process = await self._started()
        try:
            return await process.call(do, *arguments)
        except (ProcessEnded, KeyError) as error:
            if isinstance(error, ProcessEnded) and process is self._process:  # and not the next one, which others began
                self._process = None
                self._sessions.clear()
            raise End(DETECTOR_LOST, "the detector's process ended; open a new session") from error

    async def _started(self) -> SideProcess:
        async with self._starting:
            if self._process is None:
                self._process = await SideProcess.start()
            return self._process

    async def stop(self) -> None:
        """End the worker."""
        if self._process is not None:
            await self._process.stop()
