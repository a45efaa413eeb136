"""The live stream: frames in, slip states out, of a session whose detector lives in a worker process."""

import asyncio
import logging
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import msgspec
from starlette.websockets import WebSocket, WebSocketDisconnect

from db.blobs import Spool
from db.errors import NotFound, StorageUnavailable
from db.records import Sensor
from db.repositories import sensors
from service.domain.access.keys import check_not_ended
from service.domain.access.principal import Principal
from service.domain.errors import DomainError, KeyEnded, NoModel
from service.domain.models.recommended import AUTO
from service.domain.models.stored_results import to_client_model
from service.domain.resources.context import Context
from service.domain.sensors.names import grasping
from service.domain.sensors.reconstruct import described_by_another
from service.domain.uploads.upload import UploadRequest, check_target
from service.formats.reading import Description
from service.json_objects import RepeatedKey
from service.stream.detector_session import PackedFrame
from service.stream.errors import FINISHED, IN_USE, KEY_ENDED, NOT_UNDERSTOOD, REFUSED, SLOW_READER, STORAGE_AWAY, End
from service.stream.messages import (
    UNNAMED,
    Finish,
    FrameIn,
    Incoming,
    Open,
    Resume,
    decode_binary,
    decode_text,
    packed,
    packed_or_none,
)
from service.stream.sessions import RECONNECT_SECONDS, Session, Streams
from service.stream.sockets import KEY_SECONDS, close, until_one_ends
from slipcore.errors import InvalidInput

if TYPE_CHECKING:
    from stiction_client import FrictionModel

logger = logging.getLogger(__name__)

Store = Callable[[Spool, Description, UploadRequest], dict[str, Any]]
"""Stores the log in a file that a detector wrote; returns what its client is answered."""

Sent = tuple[Callable[[bytes], Incoming], bytes]
"""A message as it came, and its decoder: in lists, 1 MiB of it may take 50 times as much."""

MOST_WAITING_IN, MOST_WAITING_OUT = 8, 64
"""Messages of one connection between network and detector: beyond the first the client waits, beyond the second it is
dropped, for it does not read."""


async def serve(socket: WebSocket, context: Context, streams: Streams, principal: Principal, store: Store) -> None:
    """One connection from its first message to its end; ``store`` keeps a log that it recorded."""
    connection = _Connection(socket, context, streams, principal, store)
    try:
        await connection.run()
    except End as end:
        await close(socket, end.code, end.reason)
    except InvalidInput as error:
        await close(socket, REFUSED, f"{error.name} is {error.value}; allowed: {error.allowed}")
    except KeyEnded as error:
        await close(socket, KEY_ENDED, str(error))
    except (DomainError, NotFound) as error:
        await close(socket, REFUSED, str(error))
    except StorageUnavailable as error:
        logger.warning("a stream waits: %s", error)
        await close(socket, STORAGE_AWAY, str(error))
    except WebSocketDisconnect:
        return


def _decoded(decode: Callable[[bytes], Incoming], content: bytes) -> Incoming:
    try:
        return decode(content)
    except (msgspec.MsgspecError, UnicodeDecodeError, RecursionError) as error:
        raise End(NOT_UNDERSTOOD, str(error)) from error
    except RepeatedKey as error:
        raise End(NOT_UNDERSTOOD, f"a message with {error}") from error


class _Connection:
    def __init__(
        self, socket: WebSocket, context: Context, streams: Streams, principal: Principal, store: Store
    ) -> None:
        self._socket, self._context, self._principal, self._store = socket, context, principal, store
        self._streams = streams
        self._incoming: asyncio.Queue[Sent] = asyncio.Queue(MOST_WAITING_IN)
        self._outgoing: asyncio.Queue[dict[str, Any]] = asyncio.Queue(MOST_WAITING_OUT)
        self._encode: Callable[[Any], bytes] = msgspec.msgpack.encode
        self._is_text = False

    async def run(self) -> None:
        try:
            first = _decoded(*await asyncio.wait_for(self._receive(), RECONNECT_SECONDS))
        except TimeoutError as error:
            raise End(NOT_UNDERSTOOD, f"nothing was said for {RECONNECT_SECONDS:g} s") from error
        session, missed = await self._begin(first)
        self._streams.join(session)
        try:
            await until_one_ends(self._talk(session, missed), self._let_go(session))
        finally:
            self._streams.leave(session)

    async def _begin(self, first: Incoming) -> tuple[Session, list[dict[str, Any]]]:
        """The session, and the answers that its client has missed."""
        if isinstance(first, Open):
            await check_target(self._context, self._upload(first, first.detector))
            address, model = self._principal.address or "", await self._known(first)
            (gel, findings), materials = await self._gel(first), await self._candidates(first)
            session = await self._streams.open(first, self._principal.key_id, address, model, gel, materials)
            session.findings = findings
            return session, []
        if isinstance(first, Resume):
            session = await self._streams.take_over(first.session, self._principal.key_id)
            return session, session.recent.after(first.last)
        raise End(NOT_UNDERSTOOD, "the first message must be of type open or resume")

    async def _known(self, opening: Open) -> "FrictionModel | None":
        """The model that a grip controller begins with: none without a material, or while that has none."""
        if opening.control is None or not opening.control.known or opening.material is None:
            return None
        with suppress(NoModel):
            return (await self._models([opening.material], opening.sensor))[0]
        return None

    async def _candidates(self, opening: Open) -> "dict[str, FrictionModel]":
        """What a grip controller recognises, by the materials' own names; raises ``NoModel`` and ``NotFound``."""
        names = [] if opening.control is None else opening.control.materials
        models = await self._models(names, opening.sensor) if names else []
        return {model.material: model for model in models}

    async def _models(self, names: Sequence[str], sensor: str) -> "list[FrictionModel]":
        """The recommended ones of some materials, as the sensor shows them; raises ``NoModel`` and ``NotFound``."""

        def read() -> "list[FrictionModel]":
            known = self._context.models.get_all(self._context.database, names, AUTO)
            return [to_client_model(each.stored).of_sensor(grasping(sensor)) for each in known.values()]

        return await self._context.threads.run(self._principal.share, read)

    async def _gel(self, opening: Open) -> tuple[dict[str, Any] | None, list[dict[str, Any]]]:
        """Of the sensor, if one is named and described, with what is to be known of it."""

        def find() -> Sensor | None:
            with self._context.database.read() as session:
                return sensors.find(session, opening.sensor)

        found = None if opening.sensor == UNNAMED else await self._context.threads.run(self._principal.share, find)
        if found is None or found.gel is None:
            return None, []
        findings = described_by_another(found.described_by, self._principal.key_id)
        return asdict(found.gel), [asdict(finding) for finding in findings]

    async def _talk(self, session: Session, missed: list[dict[str, Any]]) -> None:
        await self._greet(session, missed)
        await self._carry(session)

    async def _let_go(self, session: Session) -> None:
        """End once another connection is to go on with the session."""
        await session.wanted.wait()
        raise End(IN_USE, "the session goes on in another connection")

    async def _greet(self, session: Session, missed: list[dict[str, Any]]) -> None:
        opened = {"type": "opened", "session": session.id, "next": session.next}
        await self._send(opened | {"detector": session.method, "findings": session.findings})
        for answer in missed:
            await self._send(answer)

    async def _carry(self, session: Session) -> None:
        """Read, work and write at once, while the key is valid, until one of them ends."""
        await until_one_ends(self._read(), self._work(session), self._write(), self._watch_key())

    async def _read(self) -> None:
        while True:
            await self._incoming.put(await self._receive())

    async def _write(self) -> None:
        while True:
            await self._send(await self._outgoing.get())

    async def _watch_key(self) -> None:
        while True:
            await asyncio.sleep(KEY_SECONDS)
            with suppress(StorageUnavailable):  # frames go on while the database is away
                await asyncio.to_thread(self._check_key)

    def _check_key(self) -> None:
        if self._principal.key_id is not None:
            with self._context.database.read() as session:
                check_not_ended(session, self._principal.key_id)

    async def _work(self, session: Session) -> None:
        while True:
            message = _decoded(*await self._incoming.get())
            if isinstance(message, FrameIn):
                await self._step(session, message)
            elif isinstance(message, Finish):
                answer = await self._finish(session, message)
                while not self._outgoing.empty():
                    await self._send(self._outgoing.get_nowait())
                await self._send(answer)
                stored = answer["grasp_log"]
                await self._streams.end(session, None if stored is None else stored["id"])
                raise End(FINISHED, "finished")
            else:
                raise End(NOT_UNDERSTOOD, "the session is open already")

    async def _step(self, session: Session, frame: FrameIn) -> None:
        if 0 <= frame.number < session.next:  # sent again after a reconnect
            return
        try:
            if frame.number < 0:
                raise InvalidInput("number", frame.number, "0 or more")
            answer, shown = await self._detect(session, frame)
            session.method = answer["detector"]
            if shown is not None:
                session.broadcast.publish(shown)
        except InvalidInput as error:
            answer = {"type": "error", "number": frame.number}
            answer |= {"name": error.name, "value": str(error.value), "allowed": error.allowed}
        if frame.number >= 0:
            session.next = frame.number + 1
            session.recent.add(answer)
        try:
            self._outgoing.put_nowait(answer)
        except asyncio.QueueFull:
            raise End(SLOW_READER, f"{MOST_WAITING_OUT} answers wait to be read") from None

    async def _detect(self, session: Session, frame: FrameIn) -> tuple[dict[str, Any], bytes | None]:
        given = PackedFrame(
            frame.number,
            frame.time,
            packed("displacement", frame.displacement),
            packed_or_none("force", frame.force),
            packed_or_none("object_pose", frame.object_pose),
            packed_or_none("normal", frame.normal),
            frame.command,
            frame.gripper_force,
            frame.gripper_force_deviation,
        )
        is_shown = session.broadcast.wants(asyncio.get_running_loop().time())
        return await self._streams.detect(session, given, is_shown)

    async def _finish(self, session: Session, message: Finish) -> dict[str, Any]:
        """Store the kept frames as an upload is stored; until the answer is there it may be said again."""
        if not message.store:
            return {"type": "finished", "grasp_log": None, "findings": session.findings}
        opening = session.opening
        if not opening.keep:
            raise End(REFUSED, "store needs keep, said when the session was opened")
        with self._context.blobs.spool() as spool:
            found = await self._streams.write(session, spool.path, opening.sensor)
            share = self._principal.share
            stored = await self._context.store_threads.run(
                share, self._store, spool, found, self._upload(opening, session.method), is_long=True
            )
        return {"type": "finished", "grasp_log": stored, "findings": session.findings}

    def _upload(self, opening: Open, method: str | None) -> UploadRequest:
        return UploadRequest(opening.material, opening.sensor or None, method, principal=self._principal)

    async def _receive(self) -> Sent:
        event = await self._socket.receive()
        if event["type"] == "websocket.disconnect":
            raise WebSocketDisconnect(event.get("code", 1000))
        text = event.get("text")
        if text is None:
            return decode_binary, event.get("bytes") or b""
        self._is_text, self._encode = True, msgspec.json.encode
        return decode_text, str(text).encode(errors="surrogatepass")

    async def _send(self, answer: dict[str, Any]) -> None:
        content = self._encode(answer)
        if self._is_text:
            await self._socket.send_text(content.decode())
        else:
            await self._socket.send_bytes(content)
