"""Ask for a fit of a material."""

from db.repositories import jobs, materials
from service.context import Context
from service.http.idempotency import Answer, Once, answer_once
from service.http.schemas import JobOut
from service.jobs.queueing import queue


def request_fit(
    context: Context, material: str, method: str, seed: int, once: Once | None, key_id: str | None = None
) -> Answer:
    """Queue a fit over all samples of a material; raises ``NotFound`` for an unknown one."""
    with context.database.write() as session:

        def ask() -> Answer:
            material_id = materials.find_id(session, material)
            job_id = queue(session, "fit", method, material_id=material_id, seed=seed, requested_by=key_id)
            job = jobs.get(session, job_id)
            return Answer(202, f"/v1/jobs/{job.id}", JobOut.of(job).model_dump(mode="json"))

        answer = answer_once(session, once, ask)
    context.jobs.wake()
    return answer
