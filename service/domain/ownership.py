"""Whose a material is: its owners, and whoever may administer, change it; without owners the scope alone decides."""

from sqlalchemy.orm import Session

from db.errors import NotFound
from db.repositories import access_keys, audit, materials, owners
from service.context import Context
from service.domain.asker import Asker
from service.http.access import insufficient_scope
from service.http.problems import INVALID_REQUEST, NOT_OWNER, UNKNOWN_OWNER, Problem


def check_may_add(session: Session, material_id: int, asker: Asker) -> None:
    """Whether somebody may upload into a material and have it fitted; raises ``Problem``."""
    _check(asker, owners.of_material(session, material_id))


def check_may_change(session: Session, material_id: int, asker: Asker) -> None:
    """Whether somebody may rename, merge or withdraw; without owners that is for admins. Raises ``Problem``."""
    found = owners.of_material(session, material_id)
    if not found and not asker.is_admin:
        raise insufficient_scope("upload", "admin")
    _check(asker, found)


def list_owners(context: Context, material: str) -> list[str]:
    """Whose a material is; raises ``NotFound``."""
    with context.database.read() as session:
        return owners.of_material(session, materials.find_id(session, material))


def add_owner(context: Context, material: str, owner: str, asker: Asker) -> list[str]:
    """Let a key or a group own a material, too; raises ``NotFound``, and ``Problem`` for a key that is not stored."""
    with context.database.write() as session:
        material_id = materials.find_id(session, material)
        check_may_change(session, material_id, asker)
        _check_owner(session, owner)
        if owners.add(session, material_id, owner):
            audit.add(session, asker.actor, "owner.added", material, {"owner": owner})
        return owners.of_material(session, material_id)


def remove_owner(context: Context, material: str, owner: str, asker: Asker) -> None:
    """Take a material from an owner; without any it is everybody's again. Raises ``NotFound`` and ``Problem``."""
    with context.database.write() as session:
        material_id = materials.find_id(session, material)
        check_may_change(session, material_id, asker)
        if not owners.remove(session, material_id, owner):
            raise Problem.wrong_value(UNKNOWN_OWNER, "owner", owner, f"an owner of {material}")
        audit.add(session, asker.actor, "owner.removed", material, {"owner": owner})


def _check(asker: Asker, found: list[str]) -> None:
    if found and not asker.is_admin and not {*asker.owners} & {*found}:
        detail = "the material has owners, and this key is none of them; one of them, or an admin, can add it"
        raise Problem(NOT_OWNER, detail, more={"owners": found})


def _check_owner(session: Session, owner: str) -> None:
    kind, _, key_id = owner.partition(":")
    if kind == "key":
        try:
            access_keys.get(session, key_id)
        except NotFound as error:
            raise Problem.wrong_value(INVALID_REQUEST, "owner", owner, "the id of a stored key") from error
