"""Take in a grasp log: stream it to disk, look whether it is one, store it with its ingest job."""

import asyncio
from collections.abc import AsyncIterator, Callable, Coroutine, Iterator
from contextlib import ExitStack, asynccontextmanager, contextmanager
from dataclasses import dataclass, field
from functools import partial
from typing import Any, TypeVar

from sqlalchemy.orm import Session

from db.blobs import Spool, disk_errors_named
from db.errors import NotFound, StorageUnavailable
from db.records import NewGraspLog
from db.repositories import materials, stores, uploads
from service import formats
from service.domain.access import quotas
from service.domain.access.principal import ANONYMOUS, Principal
from service.domain.errors import (
    InvalidGraspLog,
    InvalidValue,
    UnsupportedFormat,
)
from service.domain.materials.ownership import check_may_add
from service.domain.resources.context import Context
from service.domain.resources.receive import (
    UNPACKING_BYTES,
    check_encoding,
    check_expansion,
    check_size,
    unless_gone,
    unpack,
)
from service.domain.sensors import names
from service.domain.uploads.accept import ReceivedLog, StoredUpload, accept
from service.formats.archive import unpacked_bytes
from service.formats.reading import Description, FormatSettings
from slipcore.defaults import METHOD_NAMES
from slipcore.errors import InvalidInput

LONGEST_SENSOR_NAME = 200

Result = TypeVar("Result")


@dataclass(frozen=True, slots=True)
class UploadRequest:
    """What the uploader says of a log: its material, sensor and detector (None: the one that suits the log), type,
    length and encoding of its bytes, and the settings that its format needs (``formats.read``); ``principal`` is who
    sends it. Where ``creates_material`` is set, a material that is not known is made known with the log, or not at all.
    """

    material: str | None
    sensor: str | None
    detector: str | None
    content_type: str | None = None
    content_length: int | None = None
    content_encoding: str = ""
    settings: FormatSettings = field(default_factory=dict)
    principal: Principal = ANONYMOUS
    creates_material: bool = False


async def wait_forever() -> None:
    """Wait for somebody who does not go."""
    await asyncio.Event().wait()


@asynccontextmanager
async def received(
    context: Context,
    chunks: AsyncIterator[bytes],
    request: UploadRequest,
    gone: Callable[[], Coroutine[Any, Any, None]] = wait_forever,
) -> AsyncIterator[ReceivedLog]:
    """Take a log in, which is forgotten at the end unless it is stored.

    ``gone`` ends when the client has gone: what is still to be read then is not. Raises ``DomainError`` for what cannot
    be taken, ``QueueFull``, ``NotFound`` for an unknown material.
    """
    limit = context.settings.max_upload_bytes
    check_size(request.content_length or 0, limit)
    _check_type(request.content_type)
    encoding = check_encoding(request.content_encoding)
    in_thread = partial(context.threads.run, request.principal.share)
    material_id = await in_thread(_check_before, context, request)
    with ExitStack() as spools:
        body = spools.enter_context(context.blobs.spool())
        await context.bodies.receive(body, chunks, limit, in_thread)
        async with unless_gone(gone()):
            kept, description = await _unpack_and_read(context, spools, body, encoding, request)
        new_material = request.material if material_id is None else None
        log = _new_log(kept, description, request, material_id)
        yield ReceivedLog(kept, log, body.sha256, request.principal, new_material, request.sensor is not None)


async def receive_digest(context: Context, chunks: AsyncIterator[bytes], request: UploadRequest) -> str:
    """The SHA-256 of a body that is not to be stored; raises ``TooLarge`` and ``UploadInterrupted``."""
    limit, in_thread = context.settings.max_upload_bytes, partial(context.threads.run, request.principal.share)
    check_size(request.content_length or 0, limit)
    with context.blobs.spool() as body:
        await context.bodies.receive(body, chunks, limit, in_thread)
        return body.sha256


async def upload(context: Context, chunks: AsyncIterator[bytes], request: UploadRequest) -> StoredUpload:
    """Store a log that comes in ``chunks``, and queue its ingest; raises as ``received`` and ``accept``."""
    async with received(context, chunks, request) as log:
        do = partial(store, context, log, lambda session: accept(session, context, log))
        return await context.store_threads.run(request.principal.share, do)


async def check_target(context: Context, request: UploadRequest) -> None:
    """Raises ``DomainError`` or ``NotFound`` for what a new log could not be stored for."""
    share = request.principal.share
    await context.threads.run(share, _check, context, request)
    await context.threads.run(share, _check_quotas, context, request.principal)


def store_made(context: Context, spool: Spool, found: Description, request: UploadRequest) -> StoredUpload:
    """Store a log that the service itself has written to ``spool.path``, and queue its ingest; raises as ``upload``."""
    material_id = _check(context, request)
    spool.adopt()
    made = ReceivedLog(spool, _new_log(spool, found, request, material_id), spool.sha256, request.principal)
    return store(context, made, lambda session: accept(session, context, made))


def store(context: Context, received: ReceivedLog, make_rows: Callable[[Session], Result]) -> Result:
    """Store a log in one transaction: first the blob, durably, then the rows that refer to it, by ``accept``.

    Neither where a quota forbids them: raises ``QuotaExceeded`` and ``StorageQuotaExceeded``.
    """
    with context.database.read() as session:
        quotas.check_log(session, context.settings, received.log.uploaded_by, received.log)
    received.spool.keep()
    with context.queueing() as session:
        stores.require(session, context.database.store_id)
        uploads.lock(session, [received.log.sha256])
        if uploads.bring_back(session, received.log.sha256) and not context.blobs.has(received.log.sha256):
            raise StorageUnavailable("the file was old and about to be deleted when it came in again")
        return make_rows(session)


def _check_before(context: Context, request: UploadRequest) -> int | None:
    """What ``_check`` does, where there is room for the bytes and for what follows from them."""
    context.require_room()
    return _check(context, request)


def _check(context: Context, request: UploadRequest) -> int | None:
    """What can be checked before the bytes are there; returns the material's key, None where there is none yet."""
    if request.detector is not None and request.detector not in METHOD_NAMES:
        raise InvalidValue("detector", request.detector, ", ".join(METHOD_NAMES))
    if request.sensor is not None:
        _sensor_name(request.sensor)
    try:
        formats.parse_mapping(request.settings)
    except InvalidInput as error:
        raise InvalidValue(error.name, error.value, error.allowed) from error
    with context.database.read() as session:
        if request.sensor is not None:
            names.check_spelling(session, request.sensor)
        if request.material is None:
            return None
        try:
            material_id = materials.find_id(session, request.material)
        except NotFound:
            if request.creates_material:
                return None
            raise
        check_may_add(session, material_id, request.principal)
    return material_id


def _check_quotas(context: Context, principal: Principal) -> None:
    with context.database.read() as session:
        quotas.check_upload(session, context.settings, principal.key_id)


def _check_type(content_type: str | None) -> None:
    """A body without a type may be one that a page of another site had a browser send."""
    if not content_type:
        allowed = ", ".join((*formats.CONTENT_TYPES, *formats.UNSPECIFIC_TYPES))
        raise UnsupportedFormat("content type", "missing", allowed)


@contextmanager
def _refusals_named() -> Iterator[None]:
    """What a reader refuses is refused by the use case."""
    try:
        yield
    except formats.UnsupportedFormat as error:
        raise UnsupportedFormat(error.name, error.value, error.allowed) from error
    except formats.UnusedSetting as error:
        raise InvalidValue(error.name, error.value, error.allowed) from error
    except InvalidInput as error:
        raise InvalidGraspLog(error.name, error.value, error.allowed) from error


def _identify(spool: Spool, request: UploadRequest) -> tuple[str, int]:
    """The body's format, which must take what was said beside it, and the bytes that it unpacks to."""
    spool.flush()
    with _refusals_named(), disk_errors_named():
        name = formats.identify(spool.path, request.content_type, request.settings)
        formats.check_settings(name, request.settings)
        formats.check_start(spool.path, name)
        return name, unpacked_bytes(spool.path)


async def _unpack_and_read(
    context: Context, spools: ExitStack, body: Spool, encoding: str, request: UploadRequest
) -> tuple[Spool, Description]:
    spool, settings, share = body, context.settings, request.principal.share
    if encoding:
        spool = spools.enter_context(context.blobs.spool())
        do = partial(unpack, body, spool, encoding, settings.max_upload_bytes, settings.max_expansion)
        async with context.readers.room.turn(share, UNPACKING_BYTES):
            await context.threads.run(share, do, is_long=True)
    return await _read(context, spools, spool, request, body.size)


async def _read(
    context: Context, spools: ExitStack, spool: Spool, request: UploadRequest, received: int
) -> tuple[Spool, Description]:
    """What is to be stored, the body or a container made of it, with its description; ``received``: bytes."""
    expansion, share = context.settings.max_expansion, request.principal.share
    name, unpacked = await context.threads.run(share, _identify, spool, request)
    check_expansion(received, unpacked, expansion)
    with _refusals_named():
        if formats.FORMATS[name].plain:
            found, _ = await asyncio.gather(  # the disk is slow while the reader computes
                context.readers.describe(spool.path, name, unpacked, share),
                context.threads.run(share, spool.sync),
            )
            return spool, found
        made = spools.enter_context(context.blobs.spool())
        description = await context.readers.convert(spool.path, made.path, name, request.settings, share)
        await context.threads.run(share, made.adopt, is_long=True)
        check_expansion(received, made.size, expansion)
    return made, description


def _new_log(spool: Spool, found: Description, request: UploadRequest, material_id: int | None) -> NewGraspLog:
    return NewGraspLog(
        sha256=spool.sha256,
        bytes=spool.size,
        format=found.format,
        detector=request.detector or found.method,
        material_id=material_id,
        sensor=_sensor_name(request.sensor or found.sensor),
        frames=found.frames,
        duration=found.duration,
        grid=found.grid,
        uploaded_by=request.principal.key_id,
    )


def _sensor_name(name: str) -> str:
    if not 0 < len(name) <= LONGEST_SENSOR_NAME or not name.isprintable():
        allowed = f"1 to {LONGEST_SENSOR_NAME} printable characters"
        raise InvalidGraspLog("sensor", repr(name), allowed)
    return name
