"""Store a log that was taken in, with its ingest job, in one transaction; or find it stored."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

from sqlalchemy.orm import Session

from db.blobs import Spool
from db.errors import AlreadyExists
from db.records import NewGraspLog, StoredGraspLog
from db.repositories import audit, grasp_logs, materials
from service.domain.access import quotas
from service.domain.access.keys import check_not_ended
from service.domain.access.principal import Principal
from service.domain.jobs.queueing import INGEST_METHODS, queue
from service.domain.materials import curate
from service.domain.materials.ownership import check_may_add
from service.domain.resources.context import Context
from service.domain.sensors.names import as_found
from service.domain.uploads.sent_again import SentAgain, redo
from service.settings import Settings

LONG_FRAMES, LONG_ELEMENTS = 100_000, 1_000_000
"""Frames, and elements of all frames, beyond which an ingest takes a second: such jobs let others go first."""

COMPILED_DETECTORS = frozenset({"filter", "strain_rate"})
SLOWER = 10
"""How many times longer the other detectors take for a frame: 30 to 150 µs, and the compiled ones 3 to 17."""


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


def accept(session: Session, context: Context, received: ReceivedLog) -> StoredUpload:
    """Store a new log with its job; of a known one the job is done again where ``redo`` says so.

    Key and quotas are looked at once more: it may have been revoked, and others of it stored, since this one's body
    began. Raises ``KeyEnded``, ``NotOwner``, ``QuotaExceeded``, ``StorageQuotaExceeded``, and as ``redo``.
    """
    settings, principal = context.settings, received.principal
    check_not_ended(session, principal.key_id)
    quotas.lock(session, settings, principal.key_id)
    log = _as_stored(session, settings, received)
    quotas.check_log(session, settings, principal.key_id, log)
    try:
        log_id = grasp_logs.add(session, log)
    except AlreadyExists:
        return _accept_known(session, settings, received, log)
    queue(
        session,
        "ingest",
        INGEST_METHODS[0],
        material_id=log.material_id,
        grasp_log_id=log_id,
        requested_by=principal.key_id,
        is_long=_is_long(log),
    )
    return _recorded(session, principal, log_id, is_new=True)


def _as_stored(session: Session, settings: Settings, received: ReceivedLog) -> NewGraspLog:
    """The log with its material's key and its sensor's name as they are by now."""
    sensor = as_found(session, received.log.sensor)
    return replace(received.log, material_id=_material(session, settings, received), sensor=sensor)


def _accept_known(session: Session, settings: Settings, received: ReceivedLog, log: NewGraspLog) -> StoredUpload:
    """Of a log that is stored already: its job done again where that may find something else."""
    known = grasp_logs.get(session, grasp_logs.find_id(session, log.sha256, log.material_id, log.detector))
    sensor = log.sensor if received.names_sensor else known.sensor
    sent = SentAgain(known, log.material_id, sensor, received.principal)
    details = redo(session, settings, sent)
    if details is None:
        return StoredUpload(known, is_new=False, changes=False)
    return _recorded(session, received.principal, known.id, is_new=False, more=details)


def _recorded(
    session: Session, principal: Principal, log_id: str, *, is_new: bool, more: Mapping[str, object] | None = None
) -> StoredUpload:
    """The log as it is stored, with its entry in the audit trail, which has ``more`` than of any."""
    stored = grasp_logs.get(session, log_id)
    own = {"material": stored.material, "sha256": stored.sha256, "bytes": stored.bytes, "new": is_new}
    details = {**(more or {}), **own, "calibration": stored.calibration}
    audit.add(session, principal.actor, "grasp_log.uploaded", log_id, details)
    return StoredUpload(stored, is_new)


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


def _is_long(log: NewGraspLog) -> bool:
    frames = log.frames * (1 if log.detector in COMPILED_DETECTORS else SLOWER)
    return frames > LONG_FRAMES or frames * log.grid[0] * log.grid[1] > LONG_ELEMENTS
