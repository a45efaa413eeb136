"""What is wrong with a sensor, from stored logs of presses, and the correction of its later logs by that."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from sqlalchemy.orm import Session

from db.blobs import disk_errors_named
from db.records import Calibration, CalibrationPress, NewCalibration, Sensor
from db.repositories import calibrations, grasp_logs, sensors
from service import formats
from service.domain.access.changes import record
from service.domain.access.principal import Principal
from service.domain.errors import FileDeleted, InsufficientScope, InvalidValue
from service.domain.resources.context import Context
from service.domain.sensors.names import check_name
from slipcore.errors import SlipcoreError

if TYPE_CHECKING:
    from slipcore import Finding, GraspLog, SensorModel

MOST_ELEMENTS = 20_000_000
"""Frames times elements of all logs of a calibration: half a minute, and a gigabyte of memory."""

CORRECTED_BY_ANOTHER = "another's calibration"
"""The finding of a log that a calibration corrects which another key stored."""

OFFSET = "<f8"
"""Numbers of a stored zero."""


class Correction(NamedTuple):
    """A log as its sensor's calibration corrects it: of which ``version``, what it ``changed``, in words, and the
    ``options`` of detection; ``by``: the key that stored the calibration.
    """

    log: "GraspLog"
    version: int | None
    changed: tuple[str, ...] | None
    options: Mapping[str, float]
    by: str | None = None


async def calibrate(
    context: Context, sensor: str, presses: Sequence[CalibrationPress], principal: Principal
) -> Calibration:
    """Store what presses say of a sensor's faults; its logs that come in from then on are corrected by it.

    All keys' logs are: who may upload may calibrate once what only they have sent logs of; all else is for admins.
    Raises ``NotFound`` for a sensor or a log, ``FileDeleted``, ``InsufficientScope``, and ``InvalidValue`` for logs
    that are another sensor's or no pure presses, with what was seen in each.
    """
    hashes = await context.threads.run(principal.share, _hashes, context, sensor, presses, principal)
    paths = await context.files(principal.share, hashes)
    forces = [press.known_force for press in presses]
    try:
        model, offset = await context.readers.derive(partial(learn, sensor, paths, forces), "press", principal.share)
    except SlipcoreError as error:
        raise InvalidValue("grasp_logs", _with_ids(error, presses), "pure presses of one sensor") from error
    new = NewCalibration(tuple(presses), model, offset, principal.key_id)
    return await context.threads.run(principal.share, _store, context, sensor, new, principal)


def _store(context: Context, sensor: str, new: NewCalibration, principal: Principal) -> Calibration:
    with context.database.write() as session:
        stored = calibrations.add(session, sensor, new)  # the next one waits for the sensor's row
        _check_right(session, replace(sensors.get(session, sensor), calibration=stored.version - 1 or None), principal)
        details = {"version": stored.version, "grasp_logs": [press.grasp_log for press in new.presses]}
        record(session, principal, "sensor.calibrated", sensor, details)
    return stored


def learn(
    sensor: str, paths: Sequence[Path], known_force: Sequence[float | None]
) -> tuple[dict[str, Any], bytes | None]:
    """In a reader's process: the sensor model of stored presses without its offset, and that; raises ``SlipcoreError``.

    The logs themselves may name their sensor otherwise.
    """
    from slipcore import calibrate_sensor

    with disk_errors_named():
        logs = [replace(formats.read(path), sensor=sensor) for path in paths]
    model = calibrate_sensor(logs, known_force)
    offset = None if model.offset is None else model.offset.astype(OFFSET).tobytes()
    return replace(model, offset=None).to_json(), offset


def corrected(session: Session, log: "GraspLog", sensor: str, version: int | None, method: str) -> Correction:
    """A log by this version of its sensor's calibration, None for none; not where its lattice is another."""
    if version is None:
        return Correction(log, None, None, {})
    stored = calibrations.get(session, sensor, version)
    model = sensor_model(stored)
    if model.grid != log.grid:
        theirs, own = (" × ".join(map(str, grid)) for grid in (model.grid, log.grid))
        return Correction(log, version, (f"nothing: calibrated on {theirs} elements, and the log has {own}",), {})
    found = model.apply(log, method)
    return Correction(found.log, version, found.changed, found.options, stored.new.created_by)


def correction_findings(correction: Correction, uploaded_by: str | None) -> "list[Finding]":
    """That a calibration which another key stored than sent the log changed something in it."""
    from slipcore import Finding

    if not correction.changed or correction.by is None or correction.by == uploaded_by:
        return []
    evidence = f"version {correction.version} of the sensor's calibration, stored by key {correction.by}, corrects it"
    return [Finding(CORRECTED_BY_ANOTHER, evidence, "see what it changed; send logs under a sensor's name of your own")]


def sensor_model(stored: Calibration) -> "SensorModel":
    """As it was learnt."""
    import numpy as np

    from slipcore import SensorModel

    model = SensorModel.from_json(stored.new.model)
    if stored.new.offset is None:
        return model
    return replace(model, offset=np.frombuffer(stored.new.offset, OFFSET).reshape(*model.grid, 3))


def _check_right(session: Session, sensor: Sensor, principal: Principal) -> None:
    """Others' logs of a sensor, and what is known of it, are not for whoever may upload to bend."""
    if principal.is_admin:
        return
    if sensor.calibration is not None or not grasp_logs.are_all_of(session, sensor.id, principal.key_id):
        raise InsufficientScope("upload", "admin")


def _hashes(context: Context, sensor: str, presses: Sequence[CalibrationPress], principal: Principal) -> list[str]:
    """Of the logs, each of which is one of this sensor's, is not withdrawn and counts once; together not too much."""
    check_name(sensor)
    with context.database.read() as session:
        _check_right(session, sensors.get(session, sensor), principal)
        logs = [grasp_logs.get(session, press.grasp_log) for press in presses]
    first_of: dict[str, str] = {}
    for log in logs:
        if log.sensor != sensor:
            raise InvalidValue("grasp_log", f"{log.id}, of sensor {log.sensor}", f"a log of sensor {sensor}")
        if log.withdrawal is not None:
            raise InvalidValue("grasp_log", f"{log.id}, withdrawn", "a log that is not withdrawn")
        if log.sha256 in first_of:
            raise InvalidValue("grasp_log", f"{log.id}, with the content of {first_of[log.sha256]}", "each press once")
        first_of[log.sha256] = log.id
        if not log.has_file:
            raise FileDeleted(f"the file of grasp log {log.id} was deleted, as old uploads are here")
    elements = sum(log.frames * log.grid[0] * log.grid[1] for log in logs)
    if elements > MOST_ELEMENTS:
        raise InvalidValue("grasp_logs", f"{elements} elements in all frames", f"at most {MOST_ELEMENTS}")
    return [log.sha256 for log in logs]


def _with_ids(error: SlipcoreError, presses: Sequence[CalibrationPress]) -> str:
    """What was wrong, with the ids of the logs in which it was seen."""
    from slipcore import InvalidPress

    if not isinstance(error, InvalidPress):
        return str(error)
    return "; ".join(f"{presses[number].grasp_log}: {seen}" for number, seen in error.evidence.items())
