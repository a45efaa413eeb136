"""A log that is sent again: whether its job may end otherwise now, and is done again."""

from typing import NamedTuple

from sqlalchemy.orm import Session

from db.records import Detection, Gel, StoredGraspLog
from db.repositories import detections, friction_models, grasp_logs, jobs
from db.repositories import sensors as stored_sensors
from service.domain.access import quotas
from service.domain.access.changes import record
from service.domain.access.principal import Principal
from service.domain.errors import InsufficientScope, NotOwner, ResultsNotReady
from service.domain.materials.ownership import check_may_change
from service.domain.sensors.reconstruct import BY_ANOTHERS_GEL, RECONSTRUCTED, is_anothers
from service.settings import Settings


class SentAgain(NamedTuple):
    """A stored ``log`` that comes again: the key of its material if it has one, the sensor that it is to be of, and who
    sends it.
    """

    log: StoredGraspLog
    material_id: int | None
    sensor: str
    principal: Principal


def redo(session: Session, settings: Settings, sent: SentAgain) -> dict[str, object] | None:
    """Queue a known log's job again where it may end otherwise now (``_may_differ``), as by another sensor.

    Returns what the audit trail should say of it, None where nothing is done. Raises ``QuotaExceeded``, and for another
    sensor, which counts as a change, ``InsufficientScope``, ``NotOwner`` and ``ResultsNotReady``.
    """
    log, principal = sent.log, sent.principal
    is_others = log.sensor != sent.sensor
    is_outdated = not is_others and _is_calibrated_anew(session, log, sent.material_id, principal)
    if not (is_others or is_outdated or _may_differ(session, log)):
        return None
    quotas.check_job(session, settings, principal.key_id)
    details: dict[str, object] = {}
    if is_others:
        quotas.check_change(session, settings, principal.key_id)
        details = {"sensor": sent.sensor, "sensor_before": log.sensor}
        _change_sensor(session, log, sent.material_id, sent.sensor, principal)
        record(session, principal, "grasp_log.sensor_changed", log.id, details)
    if is_outdated:  # by the sensor's calibration of today
        grasp_logs.change_sensor(session, log.id, log.sensor)
    if is_others or is_outdated or not _can_go_on(session, log):
        _forget(session, log.id, sent.material_id)
    jobs.requeue(session, log.job.id, requested_by=principal.key_id)
    return {**details, "calibration_before": log.calibration}


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
