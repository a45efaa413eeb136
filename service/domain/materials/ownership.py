"""Whose a material is: its owners, and whoever may administer, change it; without owners the scope alone decides."""

from sqlalchemy.orm import Session

from db.errors import NotFound
from db.repositories import access_keys, materials, owners
from service.domain.access import quotas
from service.domain.access.changes import record_of_material
from service.domain.access.principal import Principal
from service.domain.errors import InsufficientScope, InvalidValue, NotOwner, UnknownOwner
from service.domain.resources.context import Context

MOST_OWNERS = 100
"""Of one material."""


def check_may_add(session: Session, material_id: int, principal: Principal) -> None:
    """Whether somebody may upload into a material and have it fitted; raises ``NotOwner``."""
    _check(principal, owners.of_material(session, material_id))


def check_may_change(session: Session, material_id: int, principal: Principal) -> None:
    """Whether somebody may rename, merge or withdraw; without owners that is for admins.

    Raises ``NotOwner`` and ``InsufficientScope``.
    """
    found = owners.of_material(session, material_id)
    if not found and not principal.is_admin:
        raise InsufficientScope("upload", "admin")
    _check(principal, found)


def list_owners(context: Context, material: str) -> list[str]:
    """Whose a material is; raises ``NotFound``."""
    with context.database.read() as session:
        return owners.of_material(session, materials.find_id(session, material))


def add_owner(context: Context, material: str, owner: str, principal: Principal) -> list[str]:
    """Let a key or a group own a material, too.

    Raises as ``check_may_change``, ``NotFound``, ``QuotaExceeded`` for a key that has changed as much as it may, and
    ``InvalidValue`` for a key that is not stored and for an owner more than a material may have.
    """
    with context.database.write() as session:
        material_id = materials.hold(session, material)
        check_may_change(session, material_id, principal)
        _check_owner(session, owner)
        known = owners.of_material(session, material_id)
        if owner not in known:
            quotas.check_change(session, context.settings, principal.key_id)
        if owners.add(session, material_id, owner):
            if len(known) >= MOST_OWNERS:
                raise InvalidValue("owners", len(known) + 1, f"at most {MOST_OWNERS} of a material")
            record_of_material(session, principal, "owner.added", material_id, {"owner": owner})
        return owners.of_material(session, material_id)


def remove_owner(context: Context, material: str, owner: str, principal: Principal) -> None:
    """Take a material from an owner; without any it is everybody's again.

    Raises as ``check_may_change``, ``NotFound``, and ``UnknownOwner`` for who does not own it.
    """
    with context.database.write() as session:
        material_id = materials.hold(session, material)
        check_may_change(session, material_id, principal)
        if not owners.remove(session, material_id, owner):
            raise UnknownOwner("owner", owner, f"an owner of {material}")
        record_of_material(session, principal, "owner.removed", material_id, {"owner": owner})


def _check(principal: Principal, found: list[str]) -> None:
    if found and not principal.is_admin and not {*principal.owners} & {*found}:
        raise NotOwner(found)


def _check_owner(session: Session, owner: str) -> None:
    kind, _, key_id = owner.partition(":")
    if kind == "key":
        try:
            access_keys.get(session, key_id)
        except NotFound as error:
            raise InvalidValue("owner", owner, "the id of a stored key") from error
