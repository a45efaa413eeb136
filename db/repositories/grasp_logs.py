"""Queries on grasp logs, with their sensors."""

import uuid

from sqlalchemy import exists, func, inspect, select, tuple_, update
from sqlalchemy.exc import IntegrityError
from sqlalchemy.orm import Session, aliased, defer

from db.errors import AlreadyExists, NotFound
from db.paging import Window, windowed
from db.records import LogFilter, NewGraspLog, StoredGraspLog, Withdrawal
from db.repositories import calibrations, copies, detections, jobs, sensors, uploads
from db.tables import DetectionRow, GraspLogRow, JobRow, MaterialRow, SampleSummaryRow, SensorRow, now

_WHOLE = (
    select(GraspLogRow, JobRow, SensorRow.name, MaterialRow.name, DetectionRow, SampleSummaryRow)
    .join(SensorRow)
    .join(JobRow, JobRow.grasp_log_id == GraspLogRow.id)
    .outerjoin(MaterialRow, MaterialRow.id == GraspLogRow.material_id)
    .outerjoin(DetectionRow, DetectionRow.grasp_log_id == GraspLogRow.id)
    .outerjoin(SampleSummaryRow, SampleSummaryRow.grasp_log_id == GraspLogRow.id)
)
"""Logs with their jobs, sensors, materials, detections and samples; made once, for that takes longer than asking."""

_LISTED = _WHOLE.options(defer(SampleSummaryRow.moments, raiseload=True))
"""The same without the moments, which are most of a row's bytes."""


def add(session: Session, log: NewGraspLog) -> str:
    """Store a new log and return its id; raises ``AlreadyExists`` for the same content, material and detector."""
    sensor_id = sensors.find_or_add(session, log.sensor)
    row = GraspLogRow(
        id=uuid.uuid4().hex,
        number=select(func.coalesce(func.max(GraspLogRow.number), 0) + 1).scalar_subquery(),
        sha256=log.sha256,
        bytes=log.bytes,
        format=log.format,
        detector=log.detector,
        material_id=log.material_id,
        sensor_id=sensor_id,
        frames=log.frames,
        duration=log.duration,
        grid_rows=log.grid[0],
        grid_columns=log.grid[1],
        uploaded_by=log.uploaded_by,
        calibration=calibrations.newest_version(session, sensor_id),
        file_since=uploads.since(session),
    )
    try:
        with session.begin_nested():
            session.add(row)
    except IntegrityError as error:
        raise AlreadyExists("grasp log", log.sha256) from error
    return row.id


def find_id(session: Session, sha256: str, material_id: int | None, detector: str) -> str:
    """The log of this content, material and detector; raises ``NotFound``."""
    found = _find_id(session, sha256, material_id, detector)
    if found is None:
        raise NotFound("grasp log", sha256)
    return found


def is_stored(session: Session, sha256: str, material_id: int | None, detector: str) -> bool:
    """Whether there is a log of this content, material and detector, with its file."""
    found = _find_id(session, sha256, material_id, detector)
    return found is not None and session.get_one(GraspLogRow, found).file_state is None


def any_in_older_schema(session: Session) -> bool:
    """Whether any log is stored, in a database of whatever schema or of none."""
    has_table = inspect(session.connection()).has_table(GraspLogRow.__tablename__)
    return has_table and session.scalar(select(GraspLogRow.id).limit(1)) is not None


def get(session: Session, log_id: str) -> StoredGraspLog:
    """One log with its job, detection and samples, in one query; raises ``NotFound``."""
    found = session.execute(_WHOLE.where(GraspLogRow.id == log_id)).one_or_none()
    if found is None:
        raise NotFound("grasp log", log_id)
    return _record(*found)


def list_all(session: Session, window: Window, wanted: LogFilter) -> list[StoredGraspLog]:
    """Logs with their jobs, detections and samples, but without the moments of these, in one query."""
    query = _LISTED
    if wanted.material_id is not None:
        query = query.where(GraspLogRow.material_id == wanted.material_id)
    if wanted.sensor is not None:
        named = select(SensorRow.id).where(SensorRow.name == wanted.sensor).scalar_subquery()
        query = query.where(GraspLogRow.sensor_id == named)  # of the index, which has them by time
    if wanted.status is not None:
        query = query.where(JobRow.status == wanted.status)
    if wanted.withdrawn is not None:
        at = GraspLogRow.withdrawn_at
        query = query.where(at.is_not(None) if wanted.withdrawn else at.is_(None))
    found = session.execute(windowed(query, window, {"created_at": GraspLogRow.created_at}, GraspLogRow.id))
    return [_record(*row, with_moments=False) for row in found]


def withdraw(session: Session, log_id: str, because: str, by: str | None = None) -> Withdrawal | None:
    """Take a log out of the fits, or only renew the reason; returns its earlier withdrawal. Raises ``NotFound``.

    ``by`` is the id of the access key with which that is asked for. The reason that it has already changes nothing.
    """
    row = _locked(session, log_id)
    before = _withdrawal(row)
    if before is None or before.because != because:
        row.withdrawn_at, row.withdrawn_because, row.withdrawn_by = row.withdrawn_at or now(), because, by
        session.flush()
    return before


def withdraw_before(
    session: Session, material_id: int, first_id: str | None, because: str, by: str | None = None
) -> list[str]:
    """Take all logs of a material that came before one, or all there are, out of the fits; returns which.

    In one statement, since others who write wait, and there may be tens of thousands. Raises ``NotFound`` where the one
    is no log of the material.
    """
    of_material = GraspLogRow.material_id == material_id
    change = update(GraspLogRow).where(of_material, GraspLogRow.withdrawn_at.is_(None))
    if first_id is not None:
        first = session.scalar(select(GraspLogRow).where(of_material, GraspLogRow.id == first_id))
        if first is None:
            raise NotFound("grasp log", first_id)
        change = change.where(tuple_(GraspLogRow.number, GraspLogRow.id) < (first.number, first.id))
    change = change.values(withdrawn_at=now(), withdrawn_because=because, withdrawn_by=by)
    found = change.returning(GraspLogRow.id).execution_options(synchronize_session=False)
    return list(session.scalars(found))


def restore(session: Session, log_id: str) -> bool:
    """Put a log back into the fits; False if it was in them. Raises ``NotFound``."""
    row = _locked(session, log_id)
    was_withdrawn = row.withdrawn_at is not None
    row.withdrawn_at = row.withdrawn_because = row.withdrawn_by = None
    session.flush()
    return was_withdrawn


def are_all_of(session: Session, sensor_id: int, key_id: str | None) -> bool:
    """Whether nobody but this key has sent logs of a sensor, withdrawn ones too."""
    others = (GraspLogRow.sensor_id == sensor_id, GraspLogRow.uploaded_by.is_distinct_from(key_id))
    return session.scalar(select(GraspLogRow.id).where(*others).limit(1)) is None


def change_sensor(session: Session, log_id: str, sensor: str) -> None:
    """Let a log be this sensor's as it is known now, as if it were sent now; raises ``NotFound``."""
    row = _locked(session, log_id)
    row.sensor_id = sensors.find_or_add(session, sensor)
    row.calibration = calibrations.newest_version(session, row.sensor_id)
    session.flush()


def move(session: Session, source_id: int, target_id: int) -> None:
    """Give a material's logs to another; those that it has already, by content and detector, stay where they are.

    But those that have samples change places with the other's own that have none (``copies``).
    """
    copies.exchange(session, target_id, source_id)
    there = aliased(GraspLogRow)
    same = (there.sha256 == GraspLogRow.sha256, there.detector == GraspLogRow.detector)
    is_there = exists().where(there.material_id == target_id, *same)
    moved = update(GraspLogRow).where(GraspLogRow.material_id == source_id, ~is_there).values(material_id=target_id)
    session.execute(moved.execution_options(synchronize_session=False))


def _record(
    row: GraspLogRow,
    job: JobRow,
    sensor: str,
    material: str | None,
    detection: DetectionRow | None,
    samples: SampleSummaryRow | None,
    *,
    with_moments: bool = True,
) -> StoredGraspLog:
    return StoredGraspLog(
        id=row.id,
        sha256=row.sha256,
        bytes=row.bytes,
        format=row.format,
        detector=row.detector,
        material=material,
        sensor=sensor,
        frames=row.frames,
        duration=row.duration,
        grid=(row.grid_rows, row.grid_columns),
        created_at=row.created_at,
        has_file=row.file_state is None,
        uploaded_by=row.uploaded_by,
        withdrawal=_withdrawal(row),
        job=jobs.record(job, material),
        detection=detections.detection_record(detection),
        samples=detections.samples_record(samples, with_moments=with_moments),
        calibration=row.calibration,
    )


def _find_id(session: Session, sha256: str, material_id: int | None, detector: str) -> str | None:
    same_material = GraspLogRow.material_id.is_(None) if material_id is None else GraspLogRow.material_id == material_id
    query = select(GraspLogRow.id).where(GraspLogRow.sha256 == sha256, same_material, GraspLogRow.detector == detector)
    return session.scalar(query)


def _locked(session: Session, log_id: str) -> GraspLogRow:
    row = session.get(GraspLogRow, log_id, with_for_update=True)
    if row is None:
        raise NotFound("grasp log", log_id)
    return row


def _withdrawal(row: GraspLogRow) -> Withdrawal | None:
    if row.withdrawn_at is None or row.withdrawn_because is None:
        return None
    return Withdrawal(row.withdrawn_at, row.withdrawn_because, row.withdrawn_by)


def count_and_bytes(session: Session) -> tuple[int, int, int]:
    """How many logs there are, how many of them without a file, and the bytes of the files of the others."""
    is_there = GraspLogRow.file_state.is_(None)
    size = func.coalesce(func.sum(GraspLogRow.bytes).filter(is_there), 0)
    found = session.execute(select(func.count(), func.count().filter(~is_there), size)).one()
    return int(found[0]), int(found[1]), int(found[2])
