"""What somebody changes: on record, and by a key that has not ended meanwhile."""

from collections.abc import Mapping
from typing import Any

from sqlalchemy.orm import Session

from db.records import AuditAction
from db.repositories import audit, materials
from service.domain.access.keys import check_not_ended
from service.domain.access.principal import Principal


def record(
    session: Session, principal: Principal, action: AuditAction, subject: str, details: Mapping[str, Any] | None = None
) -> None:
    """Record a change of this transaction in the audit trail; ``details`` is what JSON can hold.

    Raises ``KeyEnded`` for a key that was revoked or expired since its request began, whose body may have taken long.
    """
    check_not_ended(session, principal.key_id)
    audit.add(session, principal.actor, action, subject, details)


def record_of_material(
    session: Session,
    principal: Principal,
    action: AuditAction,
    material_id: int,
    details: Mapping[str, Any] | None = None,
) -> None:
    """Record a change of a material under its own name: who looks for that finds what was done by an alias, too."""
    record(session, principal, action, materials.own_name(session, material_id), details)
