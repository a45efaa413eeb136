"""Ask for a fit of a material."""

from db.repositories import audit, jobs, materials
from service.context import Context
from service.domain import quotas
from service.domain.asker import ANYBODY, Asker
from service.domain.ownership import check_may_add
from service.http.idempotency import Answer, Once, answer_once
from service.http.schemas.jobs import JobOut
from service.jobs.queueing import queue


def request_fit(
    context: Context, material: str, method: str, seed: int, once: Once | None, asker: Asker = ANYBODY
) -> Answer:
    """Queue a fit over all samples of a material; raises ``NotFound``, and ``Problem`` for one that is another's."""
    with context.database.write() as session:

        def ask() -> Answer:
            material_id = materials.find_id(session, material)
            check_may_add(session, material_id, asker)
            quotas.lock(session, context.settings, asker.key_id)
            quotas.check_job(session, context.settings, asker.key_id)
            job_id = queue(session, "fit", method, material_id=material_id, seed=seed, requested_by=asker.key_id)
            job = jobs.get(session, job_id)
            audit.add(session, asker.actor, "fit.requested", material, {"job": job_id, "method": method, "seed": seed})
            return Answer(202, f"/v1/jobs/{job.id}", JobOut.of(job).model_dump(mode="json"))

        answer = answer_once(session, once, ask)
    context.jobs.wake()
    return answer
