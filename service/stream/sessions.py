"""Sessions of the live stream, their bounds, and the worker process that has their detectors."""

import asyncio
import uuid
from collections import deque
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import msgspec

from service.domain.access.networks import network_of
from service.formats.reading import Description
from service.processes.completion import run_to_completion
from service.processes.fair_queue import UnboundedFairQueue
from service.processes.side_process import ProcessEnded, SideProcess
from service.stream import detectors
from service.stream.broadcast import Broadcast, Watchers
from service.stream.detector_session import MemoryLimit, PackedFrame, SessionOptions
from service.stream.errors import DETECTOR_LOST, IN_USE, NOT_READY, TOO_MANY, UNKNOWN_SESSION, End
from service.stream.live_frame import pack_end
from service.stream.messages import Open, packed

if TYPE_CHECKING:
    from stiction_client import FrictionModel

MOST_SESSIONS = 200
RECONNECT_SECONDS = 60.0
"""s that a session waits for its client to come back, and a new connection may take to say what it wants."""

FRAMES_AT_ONCE, FRAMES_OF_ONE = 4, 2
"""With the detectors' process, which does one after the other: one is done while the next one of an owner is sent."""

LOGS_AT_ONCE, LOGS_OF_ONE = 2, 1
"""With that process, too, which writes them beside the frames: it may take a second."""

TAKE_OVER_SECONDS = 5.0
"""s that the connection before may take to let go of a session with which another one goes on."""

PREPARE_SECONDS = 25.0
"""s that a new session waits for the kernels of its detector: loading them takes less, and clients wait longer."""

LEAST_PAUSE, MOST_PAUSE = 0.005, 0.1
"""s until a frame that came too fast is tried again."""

ANSWERS_KEPT, ANSWER_BYTES_KEPT = 256, 256 * 1024
"""Answers that a client who comes back may have missed; fewer where many elements slip."""

Result = TypeVar("Result")


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
    """What the server knows of a session; the detector is in the worker.

    ``owner`` is whose quota it counts in, ``next`` the number of the frame that is waited for; ``method`` of detection,
    None until the first frame decides; ``findings``: what its client is to know of the sensor's gel; ``wanted``:
    another connection is to go on with it, ``free``: none does.
    """

    id: str
    opening: Open
    key_id: str | None
    owner: str
    next: int = 0
    method: str | None = None
    findings: list[dict[str, Any]] = field(default_factory=list)
    recent: RecentAnswers = field(default_factory=RecentAnswers)
    connected: bool = False
    wanted: asyncio.Event = field(default_factory=asyncio.Event)
    free: asyncio.Event = field(default_factory=asyncio.Event)
    expiry: asyncio.TimerHandle | None = None
    begun_at: datetime = field(default_factory=lambda: datetime.now(UTC))
    broadcast: Broadcast = field(default_factory=Broadcast)


class Streams:
    """All sessions, and the worker process of their detectors, started with the first of them.

    An owner, which is an access key or else an address, has at most ``per_owner`` of them, and what they keep has at
    most ``most_bytes`` together, of which an owner has half of what others leave. Frames of one owner's sessions wait
    for two of another's at most, however many that has, and for no log that is written; those of connections that have
    ended meanwhile count until they are done.
    """

    def __init__(self, per_owner: int = 50, most_bytes: int = 512 * 2**20) -> None:
        self._per_owner, self._most_bytes = per_owner, most_bytes
        self._process: SideProcess | None = None
        self._starting = asyncio.Lock()
        self._sessions: dict[str, Session] = {}
        self._dropping: set[asyncio.Task[None]] = set()
        self._prepared: set[tuple[str, ...]] = set()
        self._preparing: dict[tuple[str, ...], asyncio.Task[None]] = {}
        self._watchers = Watchers()
        self._turns = UnboundedFairQueue(FRAMES_AT_ONCE, "detected", share=FRAMES_OF_ONE)
        self._logs = UnboundedFairQueue(LOGS_AT_ONCE, "written", share=LOGS_OF_ONE)

    async def open(
        self,
        opening: Open,
        key_id: str | None,
        address: str,
        model: "FrictionModel | None" = None,
        gel: Mapping[str, Any] | None = None,
        materials: "Mapping[str, FrictionModel] | None" = None,
    ) -> Session:
        """A new session; ``model``: what a grip controller that was asked for begins with, ``materials``: what it
        recognises; ``gel``: of its sensor.

        Raises ``InvalidInput`` for what cannot be a sensor or a controller, ``End`` where there are too many, and while
        its detector is being compiled.
        """
        session = Session(uuid.uuid4().hex, opening, key_id, key_id or f"address {network_of(address)}")
        self._check_room(session.owner)
        position, opening.position = packed("position", opening.position), b""
        self._sessions[session.id] = session  # before it is there, so that others who open one meanwhile count it
        try:
            await self._prepare(detectors.methods_of(opening.detector, opening.grid))
            session.method = await self.ask(
                session, detectors.open_session, position, opening.grid, opening.element_area, opening.detector,
                opening.keep, MemoryLimit(session.owner, self._most_bytes),
                SessionOptions(opening.control, model, gel, materials),
            )  # fmt: skip
        except BaseException:
            self._forget(session)
            raise
        self.leave(session)
        return session

    async def _prepare(self, methods: tuple[str, ...]) -> None:
        """Wait until the process has the kernels of these methods; raises ``End`` where that takes too long."""
        if methods in self._prepared:
            return
        preparing = self._preparing.get(methods)
        if preparing is None:
            preparing = asyncio.create_task(self.call(detectors.prepare, *methods, is_long=True))
            preparing.add_done_callback(lambda done: done.cancelled() or done.exception())  # read, as nobody may wait
            self._preparing[methods] = preparing
        await asyncio.wait({preparing}, timeout=PREPARE_SECONDS)
        if not preparing.done():
            reason = "the detector is being compiled, which takes minutes after an installation; open again in 30 s"
            raise End(NOT_READY, reason)
        self._preparing.pop(methods, None)
        preparing.result()
        self._prepared.add(methods)

    def _check_room(self, owner: str) -> None:
        if len(self._sessions) >= MOST_SESSIONS:
            raise End(TOO_MANY, f"{MOST_SESSIONS} sessions are open")
        if sum(each.owner == owner for each in self._sessions.values()) >= self._per_owner:
            raise End(TOO_MANY, f"{self._per_owner} sessions of this key, or of this address without one, are open")

    def join(self, session: Session) -> None:
        """A connection carries the session from now on."""
        session.connected = True
        session.wanted.clear()
        session.free.clear()
        if session.expiry is not None:
            session.expiry.cancel()

    def leave(self, session: Session) -> None:
        """No connection does; the session is forgotten unless there is one in time."""
        session.connected = False
        session.free.set()
        if session.id in self._sessions:
            session.expiry = asyncio.get_running_loop().call_later(RECONNECT_SECONDS, self._forget, session)

    def find(self, name: str, key_id: str | None) -> Session:
        """The session of this name and key, with or without a connection; raises ``End``."""
        session = self._sessions.get(name)
        if session is None or session.key_id != key_id:
            raise End(UNKNOWN_SESSION, "no such session, or it waited too long")
        return session

    async def take_over(self, name: str, key_id: str | None) -> Session:
        """The session to go on with, of the same key, from the connection that has it: a client whose network changed
        comes back long before the end of that is noticed. Raises ``End``.
        """
        session = self.find(name, key_id)
        if session.connected:
            session.wanted.set()
            with suppress(TimeoutError):
                await asyncio.wait_for(session.free.wait(), TAKE_OVER_SECONDS)
            session = self.find(name, key_id)
        if session.connected:
            raise End(IN_USE, "the session has a connection already")
        return session

    def list_all(self) -> list[Session]:
        """All of them, the newest first."""
        return [*reversed(self._sessions.values())]

    def get(self, name: str) -> Session | None:
        """A session to look at, whoever's it is."""
        return self._sessions.get(name)

    @contextmanager
    def watched(self, name: str, owner: str) -> Iterator[Broadcast]:
        """What is shown of a session, while it is counted that somebody watches it; raises ``End``."""
        session = self.get(name)
        if session is None:
            raise End(UNKNOWN_SESSION, "no such session, or it has ended")
        with self._watchers.one_more(owner, session.broadcast):
            yield session.broadcast

    async def end(self, session: Session, grasp_log: str | None = None) -> None:
        """Forget a session, which may have become a log."""
        if self._sessions.pop(session.id, None) is not None:
            session.broadcast.end(pack_end("The stream has ended.", grasp_log))
            await self.call(detectors.drop, session.id)

    def _forget(self, session: Session) -> None:
        """The same at once, with the detector dropped soon after."""
        if self._sessions.pop(session.id, None) is None:
            return
        session.broadcast.end(pack_end(f"The sensor has not come back for {RECONNECT_SECONDS:g} s.", None))
        if self._process is not None:
            task = asyncio.create_task(self._drop(session.id))
            self._dropping.add(task)
            task.add_done_callback(self._dropping.discard)

    async def _drop(self, name: str) -> None:
        with suppress(End):  # the process ended, and every session with it
            await self.call(detectors.drop, name)

    async def ask(self, session: Session, do: Callable[..., Result], *arguments: Any) -> Result:
        """Do something with a session's detector when it is its owner's turn; raises ``End`` as ``call`` does."""
        async with self._turns.turn(session.owner):
            return await self.call(do, session.id, *arguments)

    async def detect(self, session: Session, frame: PackedFrame, is_shown: bool) -> tuple[dict[str, Any], bytes | None]:
        """The answer to a frame and what watchers see of it; raises ``InvalidInput``, and ``End`` as ``call`` does.

        A frame that comes faster than the last ones are looked at waits, and no other session with it.
        """
        pause = LEAST_PAUSE
        while True:
            try:
                return await self.ask(session, detectors.step, frame, is_shown)
            except detectors.FitInProgress:
                await asyncio.sleep(pause)
                pause = min(2.0 * pause, MOST_PAUSE)

    async def write(self, session: Session, target: Path, sensor: str) -> Description:
        """Write the log of a session's kept frames, in turns of its own.

        Who is cancelled is so once nobody writes to ``target`` any more. Raises as ``detectors.write`` and ``call`` do.
        """
        async with self._logs.turn(session.owner):
            return await self.call(detectors.write, session.id, target, sensor, is_long=True)

    async def call(self, do: Callable[..., Result], *arguments: Any, is_long: bool = False) -> Result:
        """Do something in the worker, to its end, whoever is cancelled meanwhile (``SideProcess.call``).

        Raises ``End`` where the worker died, and all detectors with it.
        """
        process = await self._started()
        try:
            return await process.call(do, *arguments, is_long=is_long)
        except (ProcessEnded, KeyError) as error:
            if isinstance(error, ProcessEnded) and process is self._process:  # and not the next one, which others began
                self._process = None
                self._lose_all()
            raise End(DETECTOR_LOST, "the detector's process ended; open a new session") from error

    def _lose_all(self) -> None:
        """Forget all sessions, whose detectors are gone."""
        for session in self._sessions.values():
            session.broadcast.end(pack_end("The detector's process ended.", None))
        self._sessions.clear()
        self._prepared.clear()
        self._preparing.clear()

    async def _started(self) -> SideProcess:
        async with self._starting:
            if self._process is None:
                # a client that connects and leaves at once would otherwise start one process after the other
                return await run_to_completion(self._start())
            return self._process

    async def _start(self) -> SideProcess:
        self._process = await SideProcess.start()
        return self._process

    async def stop(self) -> None:
        """End the worker."""
        if self._process is not None:
            await self._process.stop()
        await asyncio.gather(*self._preparing.values(), return_exceptions=True)
