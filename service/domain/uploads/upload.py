"""Take in a grasp log: stream it to disk, look whether it is one, store it with its ingest job."""

import asyncio
from collections.abc import AsyncIterator, Callable, Coroutine, Iterator
from contextlib import ExitStack, asynccontextmanager, contextmanager
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any, TypeVar

from sqlalchemy.orm import Session

from db.blobs import Spool, disk_errors_named
from db.errors import AlreadyExists, NotFound, StorageUnavailable
from db.records import Detection, Gel, NewGraspLog, StoredGraspLog
from db.repositories import audit, detections, friction_models, grasp_logs, jobs, materials, stores, uploads
from db.repositories import sensors as stored_sensors
from service import formats
from service.domain.access import quotas
from service.domain.access.changes import record
from service.domain.access.keys import check_not_ended
from service.domain.access.principal import ANONYMOUS, Principal
from service.domain.errors import (
    InsufficientScope,
    InvalidGraspLog,
    InvalidValue,
    NotOwner,
    ResultsNotReady,
    UnsupportedFormat,
)
from service.domain.jobs.queueing import INGEST_METHODS, queue
from service.domain.materials import curate
from service.domain.materials.ownership import check_may_add, check_may_change
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
from service.domain.sensors.reconstruct import BY_ANOTHERS_GEL, RECONSTRUCTED, is_anothers
from service.formats.archive import unpacked_bytes
from service.formats.reading import Description, FormatSettings
from service.settings import Settings
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
class UploadRequest:
    """What the uploader says of a log: its material, sensor and detector, type, length and encoding of its bytes, and
    the settings that its format needs (``formats.read``); ``principal`` is who sends it. Where
    ``creates_material`` is set, a material that is not known is made known with the log, or not at all.
    """

    material: str | None
    sensor: str | None
    detector: str
    content_type: str | None = None
    content_length: int | None = None
    content_encoding: str = ""
    settings: FormatSettings = field(default_factory=dict)
    principal: Principal = ANONYMOUS
    creates_material: bool = False


@dataclass(frozen=True, slots=True)
class ReceivedLog:
    """A log on disk that is not stored yet; ``body_sha256``: of the bytes as they were sent.

    ``new_material``: the name of a material that is to be made known with it, of which ``log`` has no key.
    ``names_sensor``: whether its sensor was named beside the body.
    """

    spool: Spool
    log: NewGraspLog
    body_sha256: str
    principal: Principal
    new_material: str | None = None
    names_sensor: bool = False


@dataclass(frozen=True, slots=True)
class StoredUpload:
    """A log that is stored, by this upload or, if not ``is_new``, by one before; ``changes``: whether anything was
    done, as where the job of one that is known is done again.
    """

    log: StoredGraspLog
    is_new: bool
    changes: bool = True


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


def accept(session: Session, context: Context, received: ReceivedLog) -> StoredUpload:
    """Store a new log with its job; a known one that may end otherwise now has its job done again (``_may_differ``),
    and so has one of which another sensor is named now.

    Key and quotas are looked at once more: it may have been revoked, and others of it stored, since this one's body
    began. Raises ``KeyEnded``, ``NotOwner``, ``QuotaExceeded``, ``StorageQuotaExceeded``, and for another sensor, which
    counts as a change, as ``_change_sensor``.
    """
    settings, principal = context.settings, received.principal
    check_not_ended(session, principal.key_id)
    quotas.lock(session, settings, principal.key_id)
    material_id, sensor = _material(session, settings, received), names.as_found(session, received.log.sensor)
    log, details = replace(received.log, material_id=material_id, sensor=sensor), dict[str, object]()
    quotas.check_log(session, settings, principal.key_id, log)
    try:
        log_id, is_new = grasp_logs.add(session, log), True
        queue(
            session,
            "ingest",
            INGEST_METHODS[0],
            material_id=log.material_id,
            grasp_log_id=log_id,
            requested_by=principal.key_id,
            is_long=_is_long(log),
        )
    except AlreadyExists:
        log_id, is_new = grasp_logs.find_id(session, log.sha256, log.material_id, log.detector), False
        known = grasp_logs.get(session, log_id)
        is_others = received.names_sensor and known.sensor != sensor
        is_outdated = not is_others and _is_calibrated_anew(session, known, material_id, principal)
        if not (is_others or is_outdated or _may_differ(session, known)):
            return StoredUpload(known, is_new, changes=False)
        quotas.check_job(session, settings, principal.key_id)
        if is_others:
            quotas.check_change(session, settings, principal.key_id)
            _change_sensor(session, known, material_id, sensor, principal)
            details = {"sensor": sensor, "sensor_before": known.sensor}
            record(session, principal, "grasp_log.sensor_changed", log_id, details)
        if is_outdated:
            grasp_logs.change_sensor(session, log_id, known.sensor)
        if is_others or is_outdated or not _can_go_on(session, known):
            _forget(session, log_id, log.material_id)
        jobs.requeue(session, known.job.id, requested_by=principal.key_id)
        details["calibration_before"] = known.calibration
    stored = grasp_logs.get(session, log_id)
    details |= {"material": stored.material, "sha256": stored.sha256, "bytes": stored.bytes, "new": is_new}
    details["calibration"] = stored.calibration
    audit.add(session, principal.actor, "grasp_log.uploaded", log_id, details)
    return StoredUpload(stored, is_new)


def _forget(session: Session, log_id: str, material_id: int | None) -> None:
    """Let what was found in a log by another gel, or by none, be looked for anew: its models are outdated meanwhile."""
    if material_id is not None and detections.has_samples(session, log_id):
        friction_models.mark_outdated(session, material_id)
    detections.remove(session, log_id)


def _change_sensor(
    session: Session, log: StoredGraspLog, material_id: int | None, sensor: str, principal: Principal
) -> None:
    """Let a stored log be another sensor's: that of who sent it, or of whom its material is.

    Raises ``InsufficientScope`` and ``NotOwner``, and ``ResultsNotReady`` while its job goes by the sensor before.
    """
    _check_may_change_log(session, log, material_id, principal)
    if jobs.hold(session, log.job.id) == "running":
        raise ResultsNotReady(log.job.id, "running")
    grasp_logs.change_sensor(session, log.id, sensor)


def _check_may_change_log(session: Session, log: StoredGraspLog, material_id: int | None, principal: Principal) -> None:
    """Whether somebody sent this log or may change its material; raises ``InsufficientScope`` and ``NotOwner``."""
    if log.uploaded_by == principal.key_id:
        return
    if material_id is not None:
        check_may_change(session, material_id, principal)
    elif not principal.is_admin:
        raise InsufficientScope("upload", "admin")


def _can_go_on(session: Session, log: StoredGraspLog) -> bool:
    """Whether a job done again may take what it had found before it failed or was cancelled: it would find the same."""
    found = log.detection
    can_be_same = found is not None and not _is_unchecked(session, log.id, found) and found.gel == _gel(session, log)
    return log.job.status in {"failed", "cancelled"} and can_be_same


def _may_differ(session: Session, log: StoredGraspLog) -> bool:
    """Whether a job that has ended may end otherwise: it failed, which is our fault, was cancelled, was done by a
    version that did not look for all, or the log's forces follow from its sensor's gel, or would have, and that is
    described otherwise, or by whom else, than when they were looked for.
    """
    job, found = log.job, log.detection
    if job.status in {"failed", "cancelled"}:
        return True
    if found is not None and _is_unchecked(session, log.id, found):
        return job.finished_at is not None
    names = {finding.name for finding in (() if found is None else found.findings or ())}
    sensor, gel = stored_sensors.get(session, log.sensor), None if found is None else found.gel
    is_by_another = RECONSTRUCTED in names and is_anothers(sensor.described_by, log.uploaded_by)
    is_otherwise = sensor.gel != gel or is_by_another != (BY_ANOTHERS_GEL in names)
    by_gel = job.status == "refused" or RECONSTRUCTED in names
    return by_gel and job.finished_at is not None and is_otherwise


def _is_calibrated_anew(session: Session, log: StoredGraspLog, material_id: int | None, principal: Principal) -> bool:
    """Whether its job has ended, and its sensor was calibrated since it was sent: for who may change it."""
    is_newer = stored_sensors.get(session, log.sensor).calibration != log.calibration
    if not is_newer or log.job.finished_at is None:
        return False
    try:
        _check_may_change_log(session, log, material_id, principal)
    except (InsufficientScope, NotOwner):  # what they send again says nothing against the log as it is
        return False
    return True


def _is_unchecked(session: Session, log_id: str, found: Detection) -> bool:
    """Whether an older version did not look for findings, or whether the grasp is another log's."""
    return found.findings is None or not detections.has_signature(session, log_id)


def _gel(session: Session, log: StoredGraspLog) -> Gel | None:
    return stored_sensors.get(session, log.sensor).gel


def _material(session: Session, settings: Settings, received: ReceivedLog) -> int | None:
    """The key of the log's material: one to be made known, or one that was merged into another meanwhile."""
    material_id, principal = received.log.material_id, received.principal
    if received.new_material is not None:
        try:
            return curate.create(session, settings, received.new_material, "", principal).id
        except AlreadyExists:  # somebody else made it known while the log came in
            material_id = materials.find_id(session, received.new_material)
    if material_id is None:
        return None
    material_id = materials.still(session, material_id)
    check_may_add(session, material_id, principal)
    return material_id


def _check_before(context: Context, request: UploadRequest) -> int | None:
    """What ``_check`` does, where there is room for the bytes and for what follows from them."""
    context.require_room()
    return _check(context, request)


def _check(context: Context, request: UploadRequest) -> int | None:
    """What can be checked before the bytes are there; returns the material's key, None where there is none yet."""
    if request.detector not in METHOD_NAMES:
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
        detector=request.detector,
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


def _is_long(log: NewGraspLog) -> bool:
    frames = log.frames * (1 if log.detector in COMPILED_DETECTORS else SLOWER)
    return frames > LONG_FRAMES or frames * log.grid[0] * log.grid[1] > LONG_ELEMENTS
