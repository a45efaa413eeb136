"""Queries on materials."""

from collections.abc import Sequence

from sqlalchemy import func, select
from sqlalchemy.exc import IntegrityError
from sqlalchemy.orm import Session

from db.errors import AlreadyExists, NotFound
from db.records import Material, StoredModel
from db.repositories import friction_models
from db.tables import GraspLogRow, MaterialRow


def create(session: Session, name: str, description: str) -> Material:
    """Store a new material; raises ``AlreadyExists``."""
    row = MaterialRow(name=name, description=description)
    try:
        with session.begin_nested():
            session.add(row)
    except IntegrityError as error:
        raise AlreadyExists("material", name) from error
    return _record(row, 0, [])


def find_id(session: Session, name: str) -> int:
    """A material's key; raises ``NotFound``."""
    found = session.scalar(select(MaterialRow.id).where(MaterialRow.name == name))
    if found is None:
        raise NotFound("material", name)
    return found


def get(session: Session, name: str) -> Material:
    """One material with its current models; raises ``NotFound``."""
    return _with_counts_and_models(session, [find_id(session, name)])[0]


def list_all(session: Session) -> list[Material]:
    """Every material with its current models, by name: two queries however many there are."""
    return _with_counts_and_models(session, None)


def _with_counts_and_models(session: Session, ids: Sequence[int] | None) -> list[Material]:
    logs = select(func.count()).where(GraspLogRow.material_id == MaterialRow.id).scalar_subquery()
    query = select(MaterialRow, logs)
    if ids is not None:
        query = query.where(MaterialRow.id.in_(ids))
    rows = sorted(session.execute(query).all(), key=lambda row: row[0].name)  # not by the server's collation
    models = friction_models.all_current(session, ids)
    return [_record(row, count, [model for model in models if model.material == row.name]) for row, count in rows]


def _record(row: MaterialRow, logs: int, models: Sequence[StoredModel]) -> Material:
    return Material(row.id, row.name, row.description, row.created_at, logs, tuple(models))
