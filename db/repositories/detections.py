"""Queries on what was found in a log: detection and samples, stored together."""

from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import asdict, fields
from typing import Any

from sqlalchemy import ColumnElement, Row, Select, String, cast, delete, func, select, update
from sqlalchemy.orm import Session

from db.records import ContactFriction, Detection, Finding, Gel, SampledLog, SamplesOfLog, SampleSummary, Signature
from db.tables import DetectionRow, GraspLogRow, SampleSummaryRow, SensorRow

_NEWEST_FIRST = (GraspLogRow.number.desc(), GraspLogRow.id.desc())


def add(
    session: Session,
    log_id: str,
    detection: Detection,
    samples: SampleSummary,
    signature: bytes | None = None,
    alike: Sequence[str] = (),
) -> None:
    """Store what was found in a log, with that by which its grasp is known again in a cut or rounded log: nothing
    where nothing touched, None where it was not looked for. ``alike``: fingerprints of others that it shares most
    frames with, of up to a thousand, so that no list of logs has them.
    """
    velocity, force = samples.tangential_velocity or (None, None), samples.normal_force or (None, None)
    found = asdict(detection) | {"signature": signature, "alike": list(alike) or None}
    session.add(DetectionRow(grasp_log_id=log_id, **found))
    session.add(
        SampleSummaryRow(
            grasp_log_id=log_id,
            count=samples.count,
            none_because=samples.none_because,
            element_area=samples.element_area,
            friction_coefficient_mean=samples.friction_coefficient_mean,
            tangential_velocity_min=velocity[0],
            tangential_velocity_max=velocity[1],
            normal_force_min=force[0],
            normal_force_max=force[1],
            samples_blob=samples.samples_blob,
            moments=samples.moments,
            velocity_is_relative=samples.velocity_is_relative,
        )
    )
    session.flush()


def remove(session: Session, log_id: str) -> None:
    """Forget what was found in a log, if anything was: it is looked for anew."""
    for table in (SampleSummaryRow, DetectionRow):
        session.execute(delete(table).where(table.grasp_log_id == log_id))


def samples_of_material(session: Session, material_id: int) -> list[SamplesOfLog]:
    """The samples of a material, one entry a grasp, oldest first.

    Logs without samples, and withdrawn ones, are left out. A log that went through several detectors is one grasp
    still: the samples of the one that was sent last count. Of logs of one grasp the one with the most samples counts,
    the earliest of several.
    """
    found = session.execute(_samples(material_id).order_by(GraspLogRow.number, GraspLogRow.id)).all()
    copies = _copies(found, _alike(session, *_that_count(material_id)))
    copied = {each for others in copies.values() for each in others}
    counted = {row.sha256: row for row in found if row.sha256 not in copied}
    newest = {row.sha256: row.id for row in found}
    return [
        _samples_of_log(row, tuple(newest[each] for each in copies[row.sha256]) if row.sha256 in copies else ())
        for row in counted.values()
    ]


def logs_that_count(session: Session, material_id: int) -> Sequence[Row[Any]]:
    """What ``samples_of_material`` goes by, with each log's ``id``, of which little is read: the same while that is."""
    return session.execute(_of_samples(_WHICH, material_id).order_by(GraspLogRow.number, GraspLogRow.id)).all()


def state_of_logs(session: Session, material_id: int) -> str:
    """A text that is another one once ``logs_that_count`` says something else, in a fraction of its time."""
    found_at = cast(SampleSummaryRow.created_at, String)
    log = GraspLogRow.id + cast(GraspLogRow.sensor_id, String) + SampleSummaryRow.samples_blob + found_at
    counting = select(log.label("log")).join(SampleSummaryRow).where(*_that_count(material_id))
    ordered = counting.order_by(GraspLogRow.number, GraspLogRow.id).subquery()
    return session.scalar(select(func.aggregate_strings(ordered.c.log, ";"))) or ""


def others_of_grasp(session: Session, log_id: str, fingerprints: Collection[str]) -> list[str]:
    """Ids of other logs of its material with one of these, in the order they were sent: not withdrawn, with samples."""
    own = select(GraspLogRow.material_id, GraspLogRow.sha256).where(GraspLogRow.id == log_id)
    material_id, sha256 = session.execute(own).one()
    if material_id is None:
        return []
    query = select(GraspLogRow.id).join(SampleSummaryRow).join(DetectionRow)
    same = (DetectionRow.fingerprint.in_(fingerprints), GraspLogRow.sha256 != sha256)
    ordered = query.where(*_that_count(material_id), *same).order_by(GraspLogRow.number, GraspLogRow.id)
    return list(session.scalars(ordered))


def has_signature(session: Session, log_id: str) -> bool:
    """Whether that was looked for by which a log's grasp is known again."""
    query = select(DetectionRow.grasp_log_id).where(DetectionRow.grasp_log_id == log_id)
    return session.scalar(query.where(DetectionRow.signature.is_not(None))) is not None


def known_again(session: Session, log_id: str, most: int) -> list[str]:
    """Ids of the other logs of its material, withdrawn ones too, that have signatures: the newest ``most``, newest
    first.
    """
    own = select(GraspLogRow.material_id, GraspLogRow.sha256).where(GraspLogRow.id == log_id)
    material_id, sha256 = session.execute(own).one()
    if material_id is None:
        return []
    query = select(GraspLogRow.id).join(DetectionRow)
    of_others = (GraspLogRow.material_id == material_id, GraspLogRow.sha256 != sha256)
    ordered = query.where(*of_others, func.length(DetectionRow.signature) > 0).order_by(*_NEWEST_FIRST).limit(most)
    return list(session.scalars(ordered))


def signatures(session: Session, log_ids: Collection[str]) -> Iterator[Signature]:
    """Those of these logs, newest first, one at a time."""
    query = select(DetectionRow.grasp_log_id, DetectionRow.signature).join(GraspLogRow)
    ordered = query.where(GraspLogRow.id.in_(log_ids)).order_by(*_NEWEST_FIRST)
    with session.execute(ordered.execution_options(yield_per=10)) as rows:  # which may be left before their end
        for row in rows:
            yield Signature(row.grasp_log_id, row.signature or b"")


def fingerprints(session: Session, log_ids: Collection[str]) -> list[str]:
    """Those of these logs, oldest first."""
    query = select(DetectionRow.fingerprint).join(GraspLogRow).order_by(GraspLogRow.number, GraspLogRow.id)
    found = session.scalars(query.where(GraspLogRow.id.in_(log_ids), DetectionRow.fingerprint.is_not(None)))
    return [each for each in found if each is not None]


def newest_sampled_logs(session: Session, material_id: int, most: int) -> list[SampledLog]:
    """The same of its newest logs, newest first; of a log that went through several detectors, as it was sent last."""
    newest = _samples(material_id).add_columns(GraspLogRow.grid_rows, GraspLogRow.grid_columns)
    newest = newest.order_by(*_NEWEST_FIRST).limit(most)  # as an index has them
    rows = session.execute(newest).all()
    copies = _copies(rows, _alike(session, GraspLogRow.id.in_([row.id for row in rows])))
    copied = {each for others in copies.values() for each in others}
    found: dict[str, SampledLog] = {}
    for row in rows:
        if row.sha256 not in copied:
            grid = (row.grid_rows, row.grid_columns)
            found.setdefault(row.sha256, SampledLog(_samples_of_log(row), row.created_at, grid))
    return list(found.values())


def _alike(session: Session, *of_logs: ColumnElement[bool]) -> Iterator[tuple[str, list[str]]]:
    """Contents of logs with the fingerprints that each is alike, few at a time: each may have a thousand of them, which
    of 4,000 copies of a grasp together took 700 MB.
    """
    query = select(GraspLogRow.sha256, DetectionRow.alike).select_from(GraspLogRow).join(SampleSummaryRow)
    query = query.join(DetectionRow, DetectionRow.grasp_log_id == GraspLogRow.id)
    query = query.where(*of_logs, DetectionRow.fingerprint.is_not(None), DetectionRow.alike.is_not(None))
    for sha256, alike in session.execute(query.execution_options(yield_per=10)):
        yield sha256, alike or []


def _copies(rows: Sequence[Row[Any]], alike: Iterable[tuple[str, list[str]]]) -> dict[str, list[str]]:
    """Contents of the same grasp as another that has more samples, or as many and was sent earlier; by the content of
    that one.

    A content may have several fingerprints, by several detectors or from merged materials: they are of one grasp. So
    are those that it is ``alike`` while it is among the rows: two grasps that one recording holds are two without it.
    """
    counts: dict[str, int] = {}  # of each content, as it was sent last
    marks: dict[str, str] = {}  # the first fingerprint of each, in the order in which they were sent
    joined: dict[str, str] = {}  # fingerprints, by others of the same grasp
    there = {row.fingerprint for row in rows}

    def grasp(mark: str) -> str:
        while mark in joined:
            joined[mark] = joined.get(joined[mark], joined[mark])  # halves the way for all who go it again
            mark = joined[mark]
        return mark

    def join(content: str, others: Iterable[str]) -> None:
        of_content = grasp(marks[content])
        for mark in others:
            if (other := grasp(mark)) != of_content:
                joined[of_content] = other  # to which most of the others are joined
                of_content = other

    for row in sorted(rows, key=lambda row: (row.number, row.id)):
        counts[row.sha256] = row.samples
        if row.fingerprint is not None:
            marks.setdefault(row.sha256, row.fingerprint)
            join(row.sha256, [row.fingerprint])
    for content, others in alike:
        join(content, there.intersection(others))
    groups: dict[str, list[str]] = {}
    for content, mark in marks.items():
        groups.setdefault(grasp(mark), []).append(content)
    most = [max(found, key=lambda content: counts[content]) for found in groups.values()]
    chosen = zip(most, groups.values(), strict=True)
    return {counted: [each for each in found if each != counted] for counted, found in chosen if len(found) > 1}


_WHICH = (
    GraspLogRow.id,
    GraspLogRow.number,
    SensorRow.name.label("sensor"),
    SampleSummaryRow.samples_blob,
    DetectionRow.created_at.label("found_at"),
    DetectionRow.signature.is_not(None).label("has_signature"),
)
_WHAT = (
    GraspLogRow.sha256,
    GraspLogRow.created_at,
    SampleSummaryRow.count.label("samples"),
    SampleSummaryRow.moments,
    DetectionRow.findings,
    DetectionRow.fingerprint,
)


def _samples(material_id: int) -> Select[*tuple[Any, ...]]:
    return _of_samples((*_WHICH, *_WHAT), material_id)


def _of_samples(columns: tuple[Any, ...], material_id: int) -> Select[*tuple[Any, ...]]:
    return (
        select(*columns)
        .select_from(GraspLogRow)
        .join(SampleSummaryRow)
        .join(SensorRow, SensorRow.id == GraspLogRow.sensor_id)
        .outerjoin(DetectionRow, DetectionRow.grasp_log_id == GraspLogRow.id)
        .where(*_that_count(material_id))
    )


def _samples_of_log(row: Row[Any], copies: tuple[str, ...] = ()) -> SamplesOfLog:
    findings = tuple(finding["name"] for finding in row.findings or ())
    is_checked = row.findings is not None and row.has_signature
    return SamplesOfLog(row.id, row.samples_blob, row.moments, findings, row.sensor, copies, is_checked)


def set_moments(session: Session, log_id: str, moments: bytes) -> None:
    """Note the moments of a log whose samples an older version stored without."""
    session.execute(update(SampleSummaryRow).where(SampleSummaryRow.grasp_log_id == log_id).values(moments=moments))


def has_samples(session: Session, log_id: str) -> bool:
    """Whether a log, withdrawn or not, has samples."""
    of_it = (SampleSummaryRow.grasp_log_id == log_id, SampleSummaryRow.count > 0)
    return session.scalar(select(SampleSummaryRow.grasp_log_id).where(*of_it)) is not None


def any_samples(session: Session, material_id: int) -> bool:
    """Whether some log of a material, not withdrawn, has samples."""
    query = select(GraspLogRow.id).join(SampleSummaryRow).where(*_that_count(material_id)).limit(1)
    return session.scalar(query) is not None


def least_frictions(session: Session, material_id: int, most: int) -> list[tuple[float, tuple[str, ...]]]:
    """What friction is at least by the load that the contact of each of a material's newest logs bore, ``most`` of them
    at most, and the log's findings.

    Withdrawn logs, and those that an older version did not look for findings in, are left out, but counted: after a new
    epoch tens of thousands may be withdrawn.
    """
    of_material = GraspLogRow.material_id == material_id
    newest = select(GraspLogRow.id).where(of_material).order_by(*_NEWEST_FIRST).limit(most).subquery()
    query = (
        select(DetectionRow.contact_friction, DetectionRow.findings)
        .join(GraspLogRow, GraspLogRow.id == DetectionRow.grasp_log_id)
        .join(newest, newest.c.id == GraspLogRow.id)
        .where(GraspLogRow.withdrawn_at.is_(None))
        .order_by(*_NEWEST_FIRST)
    )
    known = [(found, against) for found, against in session.execute(query) if found and against is not None]
    return [(float(found["low"]), tuple(each["name"] for each in against)) for found, against in known]


def _that_count(material_id: int) -> tuple[ColumnElement[bool], ...]:
    return (
        GraspLogRow.material_id == material_id,
        GraspLogRow.withdrawn_at.is_(None),
        SampleSummaryRow.count > 0,
    )


def detection_record(row: DetectionRow | None) -> Detection | None:
    """The row as a plain record."""
    if row is None:
        return None
    found = {entry.name: getattr(row, entry.name) for entry in fields(Detection)}
    findings = None if row.findings is None else tuple(Finding(**each) for each in row.findings)
    contact = None if row.contact_friction is None else ContactFriction(**row.contact_friction)
    corrections = None if row.corrections is None else tuple(row.corrections)
    gel = None if row.gel is None else Gel(**row.gel)
    nested = {"findings": findings, "contact_friction": contact, "corrections": corrections, "gel": gel}
    return Detection(**found | nested)


def samples_record(row: SampleSummaryRow | None, *, with_moments: bool = True) -> SampleSummary | None:
    """The row as a plain record, which leaves the moments out where they were not asked for."""
    if row is None:
        return None
    return SampleSummary(
        count=row.count,
        none_because=row.none_because,
        element_area=row.element_area,
        friction_coefficient_mean=row.friction_coefficient_mean,
        tangential_velocity=_range(row.tangential_velocity_min, row.tangential_velocity_max),
        normal_force=_range(row.normal_force_min, row.normal_force_max),
        samples_blob=row.samples_blob,
        moments=row.moments if with_moments else None,
        velocity_is_relative=row.velocity_is_relative,
    )


def _range(low: float | None, high: float | None) -> tuple[float, float] | None:
    return None if low is None or high is None else (low, high)
