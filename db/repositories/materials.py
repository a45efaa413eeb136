"""Queries on materials and their names."""

from collections.abc import Sequence

from sqlalchemy import delete, func, select, update
from sqlalchemy.exc import IntegrityError
from sqlalchemy.orm import Session

from db.errors import AlreadyExists, NotFound
from db.paging import BY_NAME, Window, windowed
from db.records import Material, StoredModel
from db.repositories import friction_models, grasp_logs, jobs
from db.tables import GraspLogRow, MaterialNameRow, MaterialRow
from db.text import is_storable


def create(session: Session, name: str, description: str) -> Material:
    """Store a new material; raises ``AlreadyExists`` where a material or an alias has this name."""
    row = MaterialRow(name=name, description=description)
    try:
        with session.begin_nested():
            session.add(row)
            session.flush()
            session.add(MaterialNameRow(name=name, material_id=row.id))
    except IntegrityError as error:
        raise AlreadyExists("material", name) from error
    return _record(row, [], 0, 0, [])


def find_id(session: Session, name: str) -> int:
    """The key of the material that has this name or alias; raises ``NotFound``."""
    query = select(MaterialNameRow.material_id).where(MaterialNameRow.name == name)
    found = session.scalar(query) if is_storable(name) else None
    if found is None:
        raise NotFound("material", name)
    return found


def find_ids(session: Session, names: Sequence[str]) -> dict[str, int]:
    """The keys of many materials by these names or aliases, in their order, in one query; raises ``NotFound``."""
    columns = select(MaterialNameRow.name, MaterialNameRow.material_id)
    rows = session.execute(columns.where(MaterialNameRow.name.in_(filter(is_storable, names))))
    found: dict[str, int] = dict(iter(rows))
    missing = next((name for name in names if name not in found), None)
    if missing is not None:
        raise NotFound("material", missing)
    return {name: found[name] for name in names}


def own_name(session: Session, material_id: int) -> str:
    """The name that is a material's own, whatever others it is found by."""
    return session.scalars(select(MaterialRow.name).where(MaterialRow.id == material_id)).one()


def get(session: Session, name: str) -> Material:
    """One material, by its name or an alias, with its current models; raises ``NotFound``."""
    return _with_counts_and_models(session, [find_id(session, name)])[0]


def list_all(session: Session, window: Window = BY_NAME, search: str | None = None) -> list[Material]:
    """Materials with their current models, those with ``search`` in a name: four queries however many there are."""
    query = select(MaterialRow.id).where(MaterialRow.merged_into_id.is_(None))
    if search is not None:
        named_so = MaterialNameRow.name.icontains(search, autoescape=True)
        query = query.where(MaterialRow.id.in_(select(MaterialNameRow.material_id).where(named_so)))
    columns = {"name": MaterialRow.name, "created_at": MaterialRow.created_at}
    return _with_counts_and_models(session, list(session.scalars(windowed(query, window, columns, MaterialRow.id))))


def first_names(session: Session, limit: int) -> list[str]:
    """Names of the first materials, in alphabetical order, without aliases."""
    query = select(MaterialRow.name).where(MaterialRow.merged_into_id.is_(None))
    return list(session.scalars(query.order_by(MaterialRow.name).limit(limit)))


def still(session: Session, material_id: int) -> int:
    """This material, or the one that it was merged into: it stays so until the transaction ends."""
    query = select(MaterialRow.merged_into_id).where(MaterialRow.id == material_id)
    with session.begin_nested() as attempt:
        merged_into = session.scalar(query.with_for_update(read=True, key_share=True))
        if merged_into is None:
            return material_id
        attempt.rollback()  # the row is let go: who merges the other way holds the next one, and waits for this one
    return still(session, merged_into)


def merged_into(session: Session, material_id: int) -> int | None:
    """The material that this one was merged into, if it was."""
    return session.scalar(select(MaterialRow.merged_into_id).where(MaterialRow.id == material_id))


def hold(session: Session, name: str) -> int:
    """The key of the material of this name or alias, which nobody merges until the transaction ends.

    Raises ``NotFound``.
    """
    return still(session, find_id(session, name))


def describe(session: Session, material_id: int, description: str) -> None:
    """Change a material's description."""
    session.execute(update(MaterialRow).where(MaterialRow.id == material_id).values(description=description))


def rename(session: Session, material_id: int, name: str) -> None:
    """Give a material another name of its own; the old one stays as an alias. Raises ``AlreadyExists``."""
    add_alias(session, material_id, name)
    session.execute(update(MaterialRow).where(MaterialRow.id == material_id).values(name=name))


def add_alias(session: Session, material_id: int, name: str) -> bool:
    """Let a material be found by one more name; False if it has it. Raises ``AlreadyExists`` where another has it."""
    try:
        with session.begin_nested():
            session.add(MaterialNameRow(name=name, material_id=material_id))
    except IntegrityError as error:
        if find_id(session, name) != material_id:
            raise AlreadyExists("material", name) from error
        return False
    return True


def remove_alias(session: Session, material_id: int, name: str) -> None:
    """Free a name that is not a material's own; raises ``NotFound``."""
    own = select(MaterialRow.name).where(MaterialRow.id == material_id).scalar_subquery()
    of_it = (MaterialNameRow.material_id == material_id, MaterialNameRow.name == name, MaterialNameRow.name != own)
    if session.scalar(delete(MaterialNameRow).where(*of_it).returning(MaterialNameRow.name)) is None:
        raise NotFound("alias", name)


def merge(session: Session, target_id: int, source_id: int) -> None:
    """Give a material's names, logs and unfinished jobs to another; its models stay with it, as history.

    Raises ``NotFound`` where one of the two was merged away meanwhile.
    """
    two = select(MaterialRow).where(MaterialRow.id.in_((target_id, source_id))).order_by(MaterialRow.id)
    for row in session.scalars(two.with_for_update()):
        if row.merged_into_id is not None:
            raise NotFound("material", row.name)
    for table, column in ((MaterialNameRow, "material_id"), (MaterialRow, "merged_into_id")):
        session.execute(update(table).where(getattr(table, column) == source_id).values({column: target_id}))
    session.execute(update(MaterialRow).where(MaterialRow.id == source_id).values(merged_into_id=target_id))
    friction_models.retire(session, source_id)
    grasp_logs.move(session, source_id, target_id)
    jobs.move_unfinished(session, source_id, target_id)


def _with_counts_and_models(session: Session, ids: Sequence[int]) -> list[Material]:
    """The materials of these keys, in their order."""
    of_it = GraspLogRow.material_id == MaterialRow.id
    counted = select(func.count()).where(of_it)
    counts = (counted.scalar_subquery(), counted.where(GraspLogRow.withdrawn_at.is_not(None)).scalar_subquery())
    query = select(MaterialRow, *counts).where(MaterialRow.id.in_(ids))
    models, names = friction_models.all_current(session, ids), _names(session, ids)
    found = {
        row.id: _record(row, names[row.id], logs, withdrawn, models.get(row.id, []))
        for row, logs, withdrawn in session.execute(query)
    }
    return [found[material_id] for material_id in ids]


def _names(session: Session, ids: Sequence[int]) -> dict[int, list[str]]:
    query = select(MaterialNameRow.material_id, MaterialNameRow.name).order_by(MaterialNameRow.name)
    names: dict[int, list[str]] = {}
    for material_id, name in session.execute(query.where(MaterialNameRow.material_id.in_(ids))):
        names.setdefault(material_id, []).append(name)
    return names


def _record(
    row: MaterialRow, names: Sequence[str], logs: int, withdrawn: int, models: Sequence[StoredModel]
) -> Material:
    aliases = tuple(name for name in names if name != row.name)
    return Material(row.id, row.name, row.description, row.created_at, aliases, logs, withdrawn, tuple(models))
