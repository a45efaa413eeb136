"""Ask for a fit of a material."""

from sqlalchemy.orm import Session

from db.records import Job
from db.repositories import jobs, materials
from service.domain.access import quotas
from service.domain.access.changes import record_of_material
from service.domain.access.principal import ANONYMOUS, Principal
from service.domain.jobs.queueing import queue
from service.domain.materials.ownership import check_may_add
from service.settings import Settings


def request_fit(
    session: Session, settings: Settings, material: str, method: str, seed: int, principal: Principal = ANONYMOUS
) -> Job:
    """Queue a fit over all samples of a material; the workers are to be woken once it is committed.

    Raises ``NotFound``, ``NotOwner`` and ``QuotaExceeded``.
    """
    quotas.lock(session, settings, principal.key_id)
    material_id = materials.hold(session, material)
    check_may_add(session, material_id, principal)
    quotas.check_job(session, settings, principal.key_id)
    quotas.check_change(session, settings, principal.key_id)
    job_id = queue(session, "fit", method, material_id=material_id, seed=seed, requested_by=principal.key_id)
    details = {"job": job_id, "method": method, "seed": seed}
    record_of_material(session, principal, "fit.requested", material_id, details)
    return jobs.get(session, job_id)
