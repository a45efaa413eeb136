"""Queries on friction models: versions only grow, and one a material and method is current."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import asdict, fields
from typing import Any

from sqlalchemy import Select, exists, func, select, text, update
from sqlalchemy.orm import Session, aliased

from db.paging import Window, windowed
from db.records import NewModel, Scale, Scales, StoredModel
from db.tables import FrictionModelRow, GraspLogRow, MaterialNameRow, MaterialRow

NEWEST_FIRST = Window("id", descending=True)

BETWEEN_SENSORS = "between_sensors"
_OTHERWISE = {"tangential_velocity", "normal_force", "scales"}
_PLAIN = tuple(entry.name for entry in fields(NewModel) if entry.name not in _OTHERWISE)


def add(session: Session, material_id: int, job_id: str, model: NewModel, *, outdated: bool = False) -> int:
    """Store a model as the next version and make it the current one; returns the version.

    ``outdated``: the material's logs are others by now than those that it was fitted to. It does not take the place of
    one that is not.
    """
    lock(session, material_id)
    of_this_kind = (FrictionModelRow.material_id == material_id, FrictionModelRow.method == model.method)
    newest = session.scalar(select(func.max(FrictionModelRow.version)).where(*of_this_kind))
    version = (newest or 0) + 1
    replaced = (*of_this_kind, FrictionModelRow.current, *([FrictionModelRow.outdated] if outdated else []))
    session.execute(update(FrictionModelRow).where(*replaced).values(current=False))
    stays = select(FrictionModelRow.id).where(*of_this_kind, FrictionModelRow.current)
    session.add(_row(material_id, job_id, version, model, current=session.scalar(stays) is None, outdated=outdated))
    session.flush()
    return version


def lock(session: Session, material_id: int) -> None:
    """Make other writers of this material's models wait for this transaction (SQLite has one writer anyway).

    Rows that refer to the material may come in meanwhile.
    """
    session.execute(select(MaterialRow.id).where(MaterialRow.id == material_id).with_for_update(key_share=True))


def current(session: Session, material: str, method: str) -> StoredModel | None:
    """The current model of a material by a method, if there is one."""
    query = (
        _models()
        .join(MaterialNameRow, MaterialNameRow.material_id == MaterialRow.id)
        .where(MaterialNameRow.name == material, FrictionModelRow.method == method, FrictionModelRow.current)
    )
    found = session.execute(query).one_or_none()
    return None if found is None else _record(found[0], found[1])


def all_current(session: Session, material_ids: Sequence[int]) -> dict[int, list[StoredModel]]:
    """Current models of some materials, by the material's key."""
    query = _models().where(FrictionModelRow.current, FrictionModelRow.material_id.in_(material_ids))
    found: dict[int, list[StoredModel]] = {}
    for row, material in session.execute(query.order_by(FrictionModelRow.method)):
        found.setdefault(row.material_id, []).append(_record(row, material))
    return found


def materials_with_current(session: Session, methods: Collection[str], limit: int) -> list[int]:
    """Keys of at most so many materials, by their names, that have a current model by one of some methods."""
    having = select(FrictionModelRow.material_id).where(FrictionModelRow.current, FrictionModelRow.method.in_(methods))
    query = select(MaterialRow.id).where(MaterialRow.merged_into_id.is_(None), MaterialRow.id.in_(having))
    return list(session.scalars(query.order_by(MaterialRow.name).limit(limit)))


def of_same_sensors(session: Session, material_id: int, method: str, most: int) -> list[StoredModel]:
    """Current models of other materials by a method, not outdated, newest first and at most so many.

    Of materials all of whose logs, but the withdrawn ones, are of sensors that logs of this material are of.
    """
    theirs = aliased(GraspLogRow)
    own = select(GraspLogRow.sensor_id).where(
        GraspLogRow.material_id == material_id, GraspLogRow.withdrawn_at.is_(None)
    )
    foreign = exists().where(
        theirs.material_id == FrictionModelRow.material_id, theirs.withdrawn_at.is_(None), theirs.sensor_id.not_in(own)
    )
    query = _models().where(
        text("friction_models.current"),  # as the index of current models has it: older versions are not looked at
        FrictionModelRow.outdated.is_(False),
        FrictionModelRow.method == method,
        FrictionModelRow.material_id != material_id,
        MaterialRow.merged_into_id.is_(None),
        ~foreign,
    )
    found = session.execute(query.order_by(FrictionModelRow.id.desc()).limit(most))
    return [_record(row, material) for row, material in found]


def current_methods(session: Session, material_ids: Sequence[int]) -> list[str]:
    """Methods by which some of these materials have a current model, in alphabetical order."""
    of_them = FrictionModelRow.material_id.in_(material_ids) & FrictionModelRow.current
    return sorted(session.scalars(select(FrictionModelRow.method).where(of_them).distinct()))


def mark_outdated(session: Session, material_id: int, besides: Collection[str] = ()) -> None:
    """Say of a material's current models, but those by the methods ``besides``, that its logs are others since."""
    lock(session, material_id)
    of_it = (FrictionModelRow.material_id == material_id, FrictionModelRow.current)
    others = FrictionModelRow.method.not_in(besides)
    session.execute(update(FrictionModelRow).where(*of_it, others).values(outdated=True))


def outdated_methods(session: Session, material_id: int) -> list[str]:
    """Methods by which a material's current model is outdated, in alphabetical order."""
    of_it = (FrictionModelRow.material_id == material_id, FrictionModelRow.current, FrictionModelRow.outdated)
    return sorted(session.scalars(select(FrictionModelRow.method).where(*of_it)))


def retire(session: Session, material_id: int) -> None:
    """Let none of a material's models be current."""
    lock(session, material_id)
    of_it = (FrictionModelRow.material_id == material_id, FrictionModelRow.current)
    session.execute(update(FrictionModelRow).where(*of_it).values(current=False))


def versions(
    session: Session,
    material_id: int,
    method: str | None = None,
    *,
    current: bool | None = None,
    window: Window = NEWEST_FIRST,
) -> list[StoredModel]:
    """Versions of a material's models, newest first."""
    query = _models().where(FrictionModelRow.material_id == material_id)
    if method is not None:
        query = query.where(FrictionModelRow.method == method)
    if current is not None:
        query = query.where(FrictionModelRow.current.is_(current))
    found = session.execute(windowed(query, window, {"id": FrictionModelRow.id}, FrictionModelRow.id))
    return [_record(row, material) for row, material in found]


def with_ids(session: Session, ids: Sequence[int]) -> list[StoredModel]:
    """Versions by their keys, in this order; those that are not stored are left out."""
    rows = session.execute(_models().where(FrictionModelRow.id.in_(ids)))
    found = {row.id: _record(row, material) for row, material in rows}
    return [found[each] for each in ids if each in found]


def _models() -> Select[FrictionModelRow, str]:
    return select(FrictionModelRow, MaterialRow.name).join(MaterialRow)


def _row(
    material_id: int, job_id: str, version: int, model: NewModel, *, current: bool, outdated: bool
) -> FrictionModelRow:
    return FrictionModelRow(
        material_id=material_id,
        job_id=job_id,
        version=version,
        current=current,
        outdated=outdated,
        tangential_velocity_min=model.tangential_velocity[0],
        tangential_velocity_max=model.tangential_velocity[1],
        normal_force_min=model.normal_force[0],
        normal_force_max=model.normal_force[1],
        scales=None if model.scales is None else _kept(model.scales),
        **{name: getattr(model, name) for name in _PLAIN},
    )


def _record(row: FrictionModelRow, material: str) -> StoredModel:
    model = NewModel(
        method=row.method,
        coefficients=tuple(row.coefficients),
        covariance=tuple(tuple(line) for line in row.covariance),
        scale=row.scale,
        n=row.n,
        degrees_of_freedom=row.degrees_of_freedom,
        scatter_degrees_of_freedom=row.scatter_degrees_of_freedom,
        tangential_velocity=(row.tangential_velocity_min, row.tangential_velocity_max),
        normal_force=(row.normal_force_min, row.normal_force_max),
        identifiable=tuple(row.identifiable),
        element_area=row.element_area,
        diagnostics=row.diagnostics,
        cost_seconds=row.cost_seconds,
        monte_carlo_error=row.monte_carlo_error,
        scales=None if row.scales is None else _scales(row.scales),
    )
    return StoredModel(row.id, material, row.version, row.current, row.outdated, row.created_at, model)


def _kept(scales: Scales) -> dict[str, Any]:
    """Scales as they are stored: without that between sensors where there is one, as older versions have it."""
    return {name: scale for name, scale in asdict(scales).items() if scale is not None}


def _scales(kept: Mapping[str, Any]) -> Scales:
    sensors = kept.get(BETWEEN_SENSORS)
    each = {name: Scale(**scale) for name, scale in kept.items() if name != BETWEEN_SENSORS}
    return Scales(**each, between_sensors=sensors)
