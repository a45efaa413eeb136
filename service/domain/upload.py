"""Take in a grasp log: stream it to disk, look whether it is one, store it with its ingest job."""

import asyncio
from collections.abc import AsyncIterator, Callable, Coroutine
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from typing import Any, TypeVar

from sqlalchemy.orm import Session

from db.blobs import Spool, disk_errors_named
from db.errors import AlreadyExists, StorageUnavailable
from db.records import NewGraspLog, StoredGraspLog
from db.repositories import audit, grasp_logs, jobs, materials, stores, uploads
from service import formats
from service.context import Context
from service.domain import quotas
from service.domain.asker import ANYBODY, Asker
from service.domain.ownership import check_may_add
from service.domain.receive import UNPACKING_BYTES, check_encoding, check_expansion, check_size, unpack
from service.formats.archive import unpacked_bytes
from service.formats.reading import Description, Settings, to_its_end
from service.http.idempotency import Answer, Once, answer_once
from service.http.problems import (
    INVALID_GRASP_LOG,
    INVALID_REQUEST,
    UNSUPPORTED_FORMAT,
    UPLOAD_INTERRUPTED,
    Problem,
)
from service.http.schemas.grasp_logs import GraspLogOut
from service.jobs.queueing import queue
from slipcore.defaults import METHOD_NAMES
from slipcore.errors import InvalidInput

LONGEST_SENSOR_NAME = 200

LONG_FRAMES, LONG_ELEMENTS = 100_000, 1_000_000
"""Frames, and elements of all frames, beyond which an ingest takes a second: such jobs let others go first."""

COMPILED_DETECTORS = frozenset({"filter", "strain_rate"})
SLOWER = 10
"""How many times longer the other detectors take for a frame: 30 to 150 µs, and the compiled ones 3 to 17."""

Result = TypeVar("Result")


@dataclass(frozen=True, slots=True)
class Wish:
    """What the uploader says of a log: its material, sensor and detector, type and encoding of its bytes, and the
    settings that its format needs (``formats.read``); ``asker`` is who sends it.
    """

    material: str | None
    sensor: str | None
    detector: str
    content_type: str | None
    content_length: int | None
    content_encoding: str = ""
    settings: Settings = field(default_factory=dict)
    once: Once | None = None
    asker: Asker = ANYBODY


async def never() -> None:
    """Wait for somebody who does not go."""
    await asyncio.Event().wait()


async def upload(
    context: Context, chunks: AsyncIterator[bytes], wish: Wish, gone: Callable[[], Coroutine[Any, Any, None]] = never
) -> Answer:
    """Store a log and queue its ingest.

    ``gone`` ends when the client has gone: what is still to be read then is not. Raises ``Problem`` for what cannot be
    taken, ``Crowded``, ``NotFound`` for an unknown material. Nothing stays of a log that is not taken.
    """
    limit, expansion = context.settings.max_upload_bytes, context.settings.max_expansion
    check_size(wish.content_length or 0, limit)
    _check_type(wish.content_type)
    encoding = check_encoding(wish.content_encoding)
    material_id = await asyncio.to_thread(_check, context, wish)
    with ExitStack() as spools:
        body = spool = spools.enter_context(context.blobs.spool())
        await context.bodies.receive(body, chunks, limit)
        if encoding:
            spool = spools.enter_context(context.blobs.spool())
            async with context.readers.room.turn(wish.asker.share, UNPACKING_BYTES):
                await to_its_end(asyncio.to_thread(unpack, body, spool, encoding, limit, expansion))
        kept, description = await _unless_gone(_read(context, spools, spool, wish, body.size), gone())
        log = _new_log(kept, description, wish, material_id)
        once = wish.once and wish.once.about(body.sha256)
        return await asyncio.to_thread(_store, context, kept, log, once, wish.asker)


async def check_target(context: Context, wish: Wish) -> None:
    """Raises ``Problem`` or ``NotFound`` for what a new log could not be stored for."""
    await asyncio.to_thread(_check, context, wish)
    await asyncio.to_thread(_check_quotas, context, wish.asker)


async def store_made(context: Context, spool: Spool, found: Description, wish: Wish) -> Answer:
    """Store a log that the service itself has written to ``spool.path``, and queue its ingest; raises as ``upload``."""
    material_id = await asyncio.to_thread(_check, context, wish)
    await asyncio.to_thread(spool.adopt)
    log = _new_log(spool, found, wish, material_id)
    return await asyncio.to_thread(_store, context, spool, log, None, wish.asker)


async def _unless_gone(work: Coroutine[Any, Any, Result], gone: Coroutine[Any, Any, None]) -> Result:
    """The result of ``work``; raises ``Problem`` where the client has gone before it is there."""
    tasks = asyncio.create_task(work), asyncio.create_task(gone)
    try:
        await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        if not tasks[0].done():
            raise Problem(UPLOAD_INTERRUPTED, "the connection ended while the log was read")
        return tasks[0].result()
    finally:
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)


def _check(context: Context, wish: Wish) -> int | None:
    """What can be told before the bytes are there; returns the material's key."""
    if wish.detector not in METHOD_NAMES:
        raise Problem.wrong_value(INVALID_REQUEST, "detector", wish.detector, ", ".join(METHOD_NAMES))
    try:
        formats.parse_mapping(wish.settings)
    except InvalidInput as error:
        raise Problem.wrong_value(INVALID_REQUEST, error.name, error.value, error.allowed) from error
    with context.database.read() as session:
        if wish.material is None:
            return None
        material_id = materials.find_id(session, wish.material)
        check_may_add(session, material_id, wish.asker)
    return material_id


def _check_quotas(context: Context, asker: Asker) -> None:
    with context.database.read() as session:
        quotas.check_upload(session, context.settings, asker.key_id)


def _check_type(content_type: str | None) -> None:
    """A body without a type may be one that a page of another site had a browser send."""
    if not content_type:
        allowed = ", ".join((*formats.CONTENT_TYPES, *formats.UNSPECIFIC_TYPES))
        raise Problem.wrong_value(UNSUPPORTED_FORMAT, "content type", "missing", allowed)


def _identify(spool: Spool, wish: Wish) -> tuple[str, int]:
    """The body's format, which must take what was said beside it, and the bytes that it unpacks to."""
    spool.flush()
    try:
        with disk_errors_named():
            name = formats.identify(spool.path, wish.content_type)
            formats.check_settings(name, wish.settings)
            formats.check_start(spool.path, name)
            return name, unpacked_bytes(spool.path)
    except formats.UnsupportedFormat as error:
        raise Problem.wrong_value(UNSUPPORTED_FORMAT, error.name, error.value, error.allowed) from error
    except formats.UnusedSetting as error:
        raise Problem.wrong_value(INVALID_REQUEST, error.name, error.value, error.allowed) from error
    except InvalidInput as error:
        raise Problem.wrong_value(INVALID_GRASP_LOG, error.name, error.value, error.allowed) from error


async def _read(
    context: Context, spools: ExitStack, spool: Spool, wish: Wish, received: int
) -> tuple[Spool, Description]:
    """What is to be stored, the body or a container made of it, with its description; ``received``: bytes."""
    expansion = context.settings.max_expansion
    name, unpacked = await asyncio.to_thread(_identify, spool, wish)
    check_expansion(received, unpacked, expansion)
    try:
        if formats.FORMATS[name].plain:
            found, _ = await asyncio.gather(  # the disk is slow while the reader computes
                context.readers.describe(spool.path, name, unpacked, wish.asker.share), asyncio.to_thread(spool.sync)
            )
            return spool, found
        made = spools.enter_context(context.blobs.spool())
        description = await context.readers.convert(spool.path, made.path, name, wish.settings, wish.asker.share)
        await asyncio.to_thread(made.adopt)
        check_expansion(received, made.size, expansion)
    except formats.UnsupportedFormat as error:
        raise Problem.wrong_value(UNSUPPORTED_FORMAT, error.name, error.value, error.allowed) from error
    except InvalidInput as error:
        raise Problem.wrong_value(INVALID_GRASP_LOG, error.name, error.value, error.allowed) from error
    return made, description


def _new_log(spool: Spool, found: Description, wish: Wish, material_id: int | None) -> NewGraspLog:
    return NewGraspLog(
        sha256=spool.sha256,
        bytes=spool.size,
        format=found.format,
        detector=wish.detector,
        material_id=material_id,
        sensor=_sensor_name(wish.sensor or found.sensor),
        frames=found.frames,
        duration=found.duration,
        grid=found.grid,
        uploaded_by=wish.asker.key_id,
    )


def _sensor_name(name: str) -> str:
    if not 0 < len(name) <= LONGEST_SENSOR_NAME or not name.isprintable():
        allowed = f"1 to {LONGEST_SENSOR_NAME} printable characters"
        raise Problem.wrong_value(INVALID_GRASP_LOG, "sensor", repr(name), allowed)
    return name


def _store(context: Context, spool: Spool, log: NewGraspLog, once: Once | None, asker: Asker) -> Answer:
    """First the blob, durably, then the rows that refer to it; neither where a quota forbids them."""
    with context.database.read() as session:
        quotas.check_log(session, context.settings, asker.key_id, log)
    spool.keep()
    with context.database.write() as session:
        stores.require(session, context.database.store_id)
        uploads.lock(session, [log.sha256])
        if uploads.bring_back(session, log.sha256) and not context.blobs.has(log.sha256):
            raise StorageUnavailable("the file was old and about to be deleted when it came in again")
        answer = answer_once(session, once, lambda: _accept(context, session, log, asker))
    context.jobs.wake()
    return answer


def _accept(context: Context, session: Session, log: NewGraspLog, asker: Asker) -> Answer:
    """Store a new log with its job; a known one whose job failed, which is our fault, or was cancelled gets another.

    Quotas are looked at once more: others of the same key may have been stored since this one's body began.
    """
    quotas.lock(session, context.settings, asker.key_id)
    if log.material_id is not None:  # it may have been merged into another while the log came in
        material_id = materials.still(session, log.material_id)
        check_may_add(session, material_id, asker)
        log = replace(log, material_id=material_id)
    quotas.check_log(session, context.settings, asker.key_id, log)
    try:
        log_id, status = grasp_logs.add(session, log), 202
        queue(
            session,
            "ingest",
            "ols",
            material_id=log.material_id,
            grasp_log_id=log_id,
            requested_by=asker.key_id,
            is_long=_is_long(log),
        )
    except AlreadyExists:
        log_id, status = grasp_logs.find_id(session, log.sha256, log.material_id, log.detector), 200
        job = grasp_logs.get(session, log_id).job
        if job.status not in {"failed", "cancelled"}:
            return _stored(status, grasp_logs.get(session, log_id))
        quotas.check_job(session, context.settings, asker.key_id)
        jobs.requeue(session, job.id, requested_by=asker.key_id)
    stored = grasp_logs.get(session, log_id)
    told = {"material": stored.material, "sha256": stored.sha256, "bytes": stored.bytes, "new": status == 202}
    audit.add(session, asker.actor, "grasp_log.uploaded", log_id, told)
    return _stored(status, stored)


def _is_long(log: NewGraspLog) -> bool:
    frames = log.frames * (1 if log.detector in COMPILED_DETECTORS else SLOWER)
    return frames > LONG_FRAMES or frames * log.grid[0] * log.grid[1] > LONG_ELEMENTS


def _stored(status: int, log: StoredGraspLog) -> Answer:
    return Answer(status, f"/v1/grasp-logs/{log.id}", GraspLogOut.of(log).model_dump(mode="json"))
