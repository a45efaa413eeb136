"""Put right what was stored: names of materials, two that are one, logs that should not count."""

from collections.abc import Callable, Iterable

from sqlalchemy.orm import Session

from db.errors import NotFound
from db.records import Job, Material, StoredGraspLog
from db.repositories import detections, friction_models, grasp_logs, jobs, materials, materials_of_logs, owners
from service.domain.access import quotas
from service.domain.access.changes import record, record_of_material
from service.domain.access.principal import ANONYMOUS, Principal
from service.domain.errors import InsufficientScope, InvalidValue
from service.domain.jobs.queueing import queue
from service.domain.materials.ownership import check_may_change
from service.domain.resources.context import Context
from service.settings import Settings

MOST_ALIASES = 100
"""Of one material."""

REFITTED = "ols"
"""The method by which a material is fitted even if it has no model yet, as after an upload."""


def create(session: Session, settings: Settings, name: str, description: str, principal: Principal) -> Material:
    """Make a material known, which belongs to the principal's key and its group.

    Raises ``AlreadyExists``, and ``QuotaExceeded`` for a key that has changed as much as it may.
    """
    quotas.check_change(session, settings, principal.key_id)
    made = materials.create(session, name, description)
    for owner in principal.owners:
        owners.add(session, made.id, owner)
    details = {"description": description, "owners": list(principal.owners)}
    record(session, principal, "material.created", name, details)
    return made


def change(
    context: Context,
    material: str,
    name: str | None,
    description: str | None,
    principal: Principal = ANONYMOUS,
    check: Callable[[Material], None] = lambda _: None,
) -> Material:
    """Rename a material, its old name becoming an alias, or change its description.

    ``check`` raises where it is not to be changed as it is; nobody else changes it meanwhile. Raises as that,
    ``NotFound``, ``AlreadyExists`` for a name that another material has, ``NotOwner`` or ``InsufficientScope`` for who
    may not, ``QuotaExceeded``, and ``InvalidValue`` for an alias more than a material may have.
    """
    with context.database.write() as session:
        quotas.lock(session, context.settings, principal.key_id)
        material_id = _changeable(session, material, principal)
        friction_models.lock(session, material_id)
        before = materials.get(session, material)
        check(before)
        name = None if name == before.name else name
        description = None if description == before.description else description
        if (name, description) != (None, None):
            quotas.check_change(session, context.settings, principal.key_id)
            record(session, principal, "material.changed", before.name, {"name": name, "description": description})
        if description is not None:
            materials.describe(session, material_id, description)
        if name is not None:
            materials.rename(session, material_id, name)
        changed = materials.get(session, name or material)
        if len(changed.aliases) > len(before.aliases):
            _check_aliases(changed)
    context.models.seen()
    return changed


def add_alias(context: Context, material: str, alias: str, principal: Principal = ANONYMOUS) -> Material:
    """Let a material be found by one more name; raises as ``change``."""
    with context.database.write() as session:
        quotas.check_change(session, context.settings, principal.key_id)
        is_new = materials.add_alias(session, _changeable(session, material, principal), alias)
        changed = materials.get(session, material)
        if is_new:
            _check_aliases(changed)
            record(session, principal, "alias.added", changed.name, {"alias": alias})
    return changed


def remove_alias(context: Context, material: str, alias: str, principal: Principal = ANONYMOUS) -> None:
    """Free an alias; raises as ``change``."""
    with context.database.write() as session:
        material_id = _changeable(session, material, principal)
        materials.remove_alias(session, material_id, alias)
        record_of_material(session, principal, "alias.removed", material_id, {"alias": alias})
    context.models.seen()


def merge(context: Context, material: str, source: str, principal: Principal = ANONYMOUS) -> tuple[Material, list[Job]]:
    """Put what is known of ``source`` to ``material`` and refit it; both are the principal's; raises as ``change``."""
    with context.database.write() as session:
        target_id, source_id = (materials.find_id(session, name) for name in (material, source))
        for each in (target_id, source_id):
            check_may_change(session, each, principal)
        if target_id == source_id:
            raise InvalidValue("source", source, "another material than the one in the path")
        methods = friction_models.current_methods(session, [target_id, source_id])
        details = {"source": materials.own_name(session, source_id)}
        materials.merge(session, target_id, source_id)
        record_of_material(session, principal, "material.merged", target_id, details)
        queued = _queue_refits(session, target_id, methods, principal.key_id)
        merged = materials.get(session, material)
        _check_aliases(merged)
    return merged, _follow_up(context, queued)


def begin_epoch(
    context: Context, material: str, because: str, first_log: str | None, principal: Principal = ANONYMOUS
) -> tuple[Material, int, list[Job]]:
    """Let what was recorded of a material before ``first_log``, or until now, count in no fit, as its surface changed.

    Returns the material, how many logs were withdrawn, and the fits that follow. Raises as ``change``, and
    ``InvalidValue`` where ``first_log`` is no log of the material.
    """
    with context.database.write() as session:
        material_id = _changeable(session, material, principal)
        friction_models.lock(session, material_id)  # before the logs, as who withdraws one does
        try:
            withdrawn = grasp_logs.withdraw_before(session, material_id, first_log, because, principal.key_id)
        except NotFound as error:
            raise InvalidValue("first_grasp_log", first_log, f"a log of {material}, or null") from error
        if withdrawn:
            details = {"reason": because, "first_grasp_log": first_log, "withdrawn": len(withdrawn)}
            record_of_material(session, principal, "material.epoch_begun", material_id, details)
        queued = _refit_without(session, material_id, principal.key_id) if withdrawn else []
        found = materials.get(session, material)
    return found, len(withdrawn), _follow_up(context, queued)


def withdraw(
    context: Context, log_id: str, because: str, principal: Principal = ANONYMOUS
) -> tuple[StoredGraspLog, list[Job]]:
    """Take a log out of its material's fits, and fit again without it, or only renew the reason; raises as ``change``.

    ``QuotaExceeded`` is for a renewed reason alone.
    """
    with context.database.write() as session:
        material_id = _material_to_change(session, log_id, principal)
        known = grasp_logs.get(session, log_id).withdrawal
        if known is not None and known.because != because:
            quotas.check_change(session, context.settings, principal.key_id)
        before = grasp_logs.withdraw(session, log_id, because, principal.key_id)
        if before is None or before.because != because:
            record(session, principal, "grasp_log.withdrawn", log_id, {"reason": because})
        had_part = before is None and detections.has_samples(session, log_id)
        queued = _refit_without(session, material_id, principal.key_id) if had_part else []
        log = grasp_logs.get(session, log_id)
    return log, _follow_up(context, queued)


def counts_instead(context: Context, log_id: str) -> str | None:
    """The log, by its id, that counts in place of a copy that a merge left behind, if there is one."""
    with context.database.read() as session:
        return materials_of_logs.counts_instead(session, log_id)


def restore(context: Context, log_id: str, principal: Principal = ANONYMOUS) -> tuple[StoredGraspLog, list[Job]]:
    """Put a withdrawn log back into its material's fits, and fit again with it; raises as ``change``."""
    with context.database.write() as session:
        material_id = _material_to_change(session, log_id, principal)
        if grasp_logs.get(session, log_id).withdrawal is not None:
            quotas.check_change(session, context.settings, principal.key_id)
        was_withdrawn = grasp_logs.restore(session, log_id)
        if was_withdrawn:
            record(session, principal, "grasp_log.restored", log_id)
        queued: list[Job] = []
        if was_withdrawn and material_id is not None and detections.has_samples(session, log_id):
            methods = friction_models.current_methods(session, [material_id])
            queued = _queue_refits(session, material_id, methods, principal.key_id)
        log = grasp_logs.get(session, log_id)
    return log, _follow_up(context, queued)


def _check_aliases(material: Material) -> None:
    """All answers that have a material have all of its names."""
    if len(material.aliases) > MOST_ALIASES:
        raise InvalidValue("aliases", len(material.aliases), f"at most {MOST_ALIASES} of a material")


def _changeable(session: Session, material: str, principal: Principal) -> int:
    """The key of a material that the principal may change, and that stays until the transaction ends."""
    material_id = materials.hold(session, material)
    check_may_change(session, material_id, principal)
    return material_id


def _material_to_change(session: Session, log_id: str, principal: Principal) -> int | None:
    """The key of the material in whose fits a log counts or may count, held; of none, the log is for admins to change.

    A copy that a merge left behind counts in no fit, and whose the merged material is now may change it.
    """
    material_id = materials_of_logs.hold(session, log_id)
    merged_into = None if material_id is None else materials.merged_into(session, material_id)
    belongs_to = merged_into or material_id
    if belongs_to is not None:
        check_may_change(session, belongs_to, principal)
    elif not principal.is_admin:
        raise InsufficientScope("upload", "admin")
    return None if merged_into else material_id


def _refit_without(session: Session, material_id: int | None, key_id: str | None) -> list[Job]:
    """Until the refits are there the models say that they are outdated; without any samples left there is none."""
    if material_id is None:
        return []
    methods = friction_models.current_methods(session, [material_id])
    friction_models.mark_outdated(session, material_id)
    if not detections.any_samples(session, material_id):
        friction_models.retire(session, material_id)
        return []
    return _queue_refits(session, material_id, methods, key_id)


def _queue_refits(session: Session, material_id: int, methods: Iterable[str], key_id: str | None) -> list[Job]:
    """The fits by these methods, those that are queued already among them: they begin after this transaction."""
    if not detections.any_samples(session, material_id):
        return []
    friction_models.mark_outdated(session, material_id)
    ids = [
        jobs.queued_fit(session, material_id, method)
        or queue(session, "fit", method, material_id=material_id, requested_by=key_id)
        for method in sorted({REFITTED, *methods})
    ]
    return [jobs.get(session, job_id) for job_id in ids]


def _follow_up(context: Context, queued: list[Job]) -> list[Job]:
    """Notify those who hold models, and those who make them."""
    context.models.seen()
    if queued:
        context.jobs.wake()
    return queued
