"""Queries on what is known of sensors' faults."""

from dataclasses import asdict

from sqlalchemy import Select, func, select
from sqlalchemy.orm import Session

from db.errors import NotFound
from db.paging import Window, windowed
from db.records import Calibration, CalibrationPress, NewCalibration
from db.tables import SensorCalibrationRow, SensorRow
from db.text import is_storable


def add(session: Session, sensor: str, new: NewCalibration) -> Calibration:
    """Store the next version of a sensor's calibration; raises ``NotFound``."""
    query = select(SensorRow.id).where(SensorRow.name == sensor).with_for_update(key_share=True)
    sensor_id = session.scalar(query) if is_storable(sensor) else None
    if sensor_id is None:
        raise NotFound("sensor", sensor)
    row = SensorCalibrationRow(
        sensor_id=sensor_id,
        version=(newest_version(session, sensor_id) or 0) + 1,
        created_by=new.created_by,
        presses=[asdict(press) for press in new.presses],
        model=dict(new.model),
        offset=new.offset,
    )
    session.add(row)
    session.flush()
    return _record(row)


def newest_version(session: Session, sensor_id: int) -> int | None:
    """None where the sensor was never calibrated."""
    query = select(func.max(SensorCalibrationRow.version)).where(SensorCalibrationRow.sensor_id == sensor_id)
    return session.scalar(query)


def get(session: Session, sensor: str, version: int) -> Calibration:
    """One version; raises ``NotFound``."""
    found = session.scalar(_of(sensor).where(SensorCalibrationRow.version == version)) if is_storable(sensor) else None
    if found is None:
        raise NotFound("calibration", f"{version} of sensor {sensor}")
    return _record(found)


def list_all(session: Session, sensor: str, window: Window) -> list[Calibration]:
    """Versions by ``id``, which is their order."""
    query = windowed(_of(sensor), window, {"id": SensorCalibrationRow.id}, SensorCalibrationRow.id)
    return [_record(row) for row in session.scalars(query)]


def _of(sensor: str) -> Select[SensorCalibrationRow]:
    return select(SensorCalibrationRow).join(SensorRow).where(SensorRow.name == sensor)


def _record(row: SensorCalibrationRow) -> Calibration:
    presses = tuple(CalibrationPress(**press) for press in row.presses)
    new = NewCalibration(presses, row.model, row.offset, row.created_by)
    return Calibration(row.id, row.version, row.created_at, new)
