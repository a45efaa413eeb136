"""Sessions of the live stream: what is said in one, and the worker process that has their detectors."""

import asyncio
import time
import uuid
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, TypeVar

import msgspec

from service.processes.side_process import ProcessEnded, SideProcess
from service.stream import live

MOST_SESSIONS = 200
PATIENCE = 60.0
"""s that a session waits for its client to come back, and a new connection may take to say what it wants."""

ANSWERS_KEPT = 256
"""Answers that a client who comes back may have missed."""

FINISHED, NOT_UNDERSTOOD, DETECTOR_LOST = 1000, 1003, 1011
UNKNOWN_SESSION, SLOW_READER, IN_USE, REFUSED, TOO_MANY, STORAGE_AWAY = 4404, 4408, 4409, 4422, 4429, 4503

Result = TypeVar("Result")
Numbers = bytes | list[Any]


class Open(msgspec.Struct, tag="open", tag_field="type", forbid_unknown_fields=True):
    """Begin: the sensor, its detector, and whether the frames are to be kept for a log of a material."""

    position: Numbers
    grid: tuple[int, int]
    element_area: float
    detector: str = "filter"
    sensor: str = "stream"
    material: str | None = None
    keep: bool = False


class Resume(msgspec.Struct, tag="resume", tag_field="type", forbid_unknown_fields=True):
    """Go on with a session; ``last`` is the number of the last answer that arrived."""

    session: str
    last: int = -1


class FrameIn(msgspec.Struct, tag="frame", tag_field="type", forbid_unknown_fields=True):
    """A frame; numbers grow."""

    number: int
    time: float
    displacement: Numbers
    force: Numbers | None = None
    object_pose: Numbers | None = None
    normal: Numbers | None = None


class Finish(msgspec.Struct, tag="finish", tag_field="type", forbid_unknown_fields=True):
    """End; ``store`` the kept frames as a grasp log."""

    store: bool = False


Incoming = Open | Resume | FrameIn | Finish
DECODE_BINARY = msgspec.msgpack.Decoder(Incoming).decode
DECODE_TEXT = msgspec.json.Decoder(Incoming).decode


class End(Exception):
    """The connection is to be closed, with this code and reason."""

    def __init__(self, code: int, reason: str) -> None:
        super().__init__(reason)
        self.code, self.reason = code, reason


@dataclass(slots=True)
class Session:
    """What the server knows of a session; the detector is in the worker."""

    id: str
    opening: Open
    key_id: str | None
    next: int = 0
    recent: deque[dict[str, Any]] = field(default_factory=lambda: deque(maxlen=ANSWERS_KEPT))
    connected: bool = False
    left: float = field(default_factory=time.monotonic)


class Streams:
    """All sessions, and the worker process of their detectors, started with the first of them."""

    def __init__(self) -> None:
        self._process: SideProcess | None = None
        self._starting = asyncio.Lock()
        self._sessions: dict[str, Session] = {}

    async def open(self, opening: Open, key_id: str | None) -> Session:
        """A new session; raises ``InvalidInput`` for what cannot be a sensor, ``End`` where there are too many."""
        await self._forget_the_lost()
        if len(self._sessions) >= MOST_SESSIONS:
            raise End(TOO_MANY, f"{MOST_SESSIONS} sessions are open")
        session = Session(uuid.uuid4().hex, opening, key_id)
        await self.call(
            live.open_session, session.id, opening.position, opening.grid, opening.element_area, opening.detector,
            opening.keep,
        )  # fmt: skip
        self._sessions[session.id] = session
        return session

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
        self._sessions.pop(session.id, None)
        await self.call(live.drop, session.id)

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

    async def _forget_the_lost(self) -> None:
        latest = time.monotonic() - PATIENCE
        for session in [each for each in self._sessions.values() if not each.connected and each.left < latest]:
            await self.end(session)
