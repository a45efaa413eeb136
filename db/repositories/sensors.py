"""Queries on sensors and the mechanics of their gels."""

from collections.abc import Collection
from dataclasses import asdict

from sqlalchemy import func, select
from sqlalchemy.exc import IntegrityError
from sqlalchemy.orm import Session

from db.errors import NotFound
from db.paging import BY_NAME, Window, windowed
from db.records import Gel, Sensor
from db.tables import GraspLogRow, SampleSummaryRow, SensorCalibrationRow, SensorRow
from db.text import is_storable

_NEWEST = (
    select(func.max(SensorCalibrationRow.version))
    .where(SensorCalibrationRow.sensor_id == SensorRow.id)
    .scalar_subquery()
)
_WHOLE = select(SensorRow, _NEWEST)
"""Sensors with the newest version of their calibrations."""


def find_or_add(session: Session, name: str) -> int:
    """The key of the sensor of this name, which is stored if it is not yet."""
    query = select(SensorRow.id).where(SensorRow.name == name)
    found = session.scalar(query)
    if found is not None:
        return found
    try:
        with session.begin_nested():
            row = SensorRow(name=name)
            session.add(row)
    except IntegrityError:  # another writer was faster
        return session.execute(query).scalar_one()
    return row.id


def hold(session: Session, name: str) -> Sensor:
    """The sensor of this name, made known if it is not yet, which nobody else describes until the transaction ends."""
    query = select(SensorRow.id).where(SensorRow.id == find_or_add(session, name))
    session.execute(query.with_for_update(key_share=True))
    return get(session, name)


def find(session: Session, name: str) -> Sensor | None:
    """A sensor with what is known of its gel; None of which nothing was heard yet."""
    found = session.execute(_WHOLE.where(SensorRow.name == name)).one_or_none() if is_storable(name) else None
    return None if found is None else _record(*found)


def get(session: Session, name: str) -> Sensor:
    """The same; raises ``NotFound``."""
    found = find(session, name)
    if found is None:
        raise NotFound("sensor", name)
    return found


def list_all(session: Session, window: Window = BY_NAME) -> list[Sensor]:
    """Sensors, by name."""
    found = session.execute(windowed(_WHOLE, window, {"name": SensorRow.name}, SensorRow.id))
    return [_record(*row) for row in found]


def count_logs(session: Session, ids: Collection[int]) -> dict[int, int]:
    """How many logs, withdrawn ones too, come from each of these sensors that any comes from, by its key."""
    query = select(GraspLogRow.sensor_id, func.count()).where(GraspLogRow.sensor_id.in_(ids))
    return {int(row[0]): int(row[1]) for row in session.execute(query.group_by(GraspLogRow.sensor_id))}


def element_area(session: Session, sensor_id: int) -> float | None:
    """Area of a sensor's smallest elements, m²: of the logs in which slip was looked for, else of its newest
    calibration; None where it has neither.
    """
    by_logs = select(func.min(SampleSummaryRow.element_area)).join(GraspLogRow)
    found = session.scalar(by_logs.where(GraspLogRow.sensor_id == sensor_id))
    if found is not None:
        return found
    model = session.scalar(
        select(SensorCalibrationRow.model)
        .where(SensorCalibrationRow.sensor_id == sensor_id)
        .order_by(SensorCalibrationRow.version.desc())
        .limit(1)
    )
    return None if model is None else model.get("element_area")


def describe(session: Session, name: str, gel: Gel, by: str | None = None) -> Sensor:
    """Store the mechanics of a sensor's gel, in place of what was stored; the sensor need not be known before.

    ``by``: id of the key that says so, None for an admin's.
    """
    row = session.get_one(SensorRow, find_or_add(session, name))
    row.young_modulus, row.poisson_ratio = gel.young_modulus, gel.poisson_ratio
    row.thickness, row.marker_depth = gel.thickness, gel.marker_depth
    row.relative_thickness = asdict(gel)["relative_thickness"]
    row.described_by = by
    session.flush()
    return get(session, name)


def _record(row: SensorRow, calibration: int | None) -> Sensor:
    if row.young_modulus is None or row.poisson_ratio is None:
        return Sensor(row.id, row.name, None, calibration)
    gel = Gel(row.young_modulus, row.poisson_ratio, row.thickness, row.marker_depth or 0.0, row.relative_thickness)
    return Sensor(row.id, row.name, gel, calibration, row.described_by)
