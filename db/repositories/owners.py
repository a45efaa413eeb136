"""Queries on the owners of materials: keys (``key:ID``) and groups of keys (``group:NAME``)."""

from sqlalchemy import delete, select
from sqlalchemy.exc import IntegrityError
from sqlalchemy.orm import Session

from db.tables import MaterialOwnerRow


def of_material(session: Session, material_id: int) -> list[str]:
    """The owners of a material, in the order of their names."""
    query = select(MaterialOwnerRow.owner).where(MaterialOwnerRow.material_id == material_id)
    return list(session.scalars(query.order_by(MaterialOwnerRow.owner)))


def add(session: Session, material_id: int, owner: str) -> bool:
    """Add an owner; False where it was one."""
    try:
        with session.begin_nested():
            session.add(MaterialOwnerRow(material_id=material_id, owner=owner))
    except IntegrityError:
        return False
    return True


def remove(session: Session, material_id: int, owner: str) -> bool:
    """Remove an owner; False where it was none."""
    of_it = (MaterialOwnerRow.material_id == material_id, MaterialOwnerRow.owner == owner)
    return session.scalar(delete(MaterialOwnerRow).where(*of_it).returning(MaterialOwnerRow.owner)) is not None
