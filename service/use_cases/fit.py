"""Ask for a fit of a material."""

from db.records import Job
from db.repositories import jobs, materials
from service.context import Context


def request_fit(context: Context, material: str, method: str, seed: int) -> Job:
    """Queue a fit over all samples of a material; raises ``NotFound`` for an unknown one."""
    with context.database.write() as session:
        material_id = materials.find_id(session, material)
        job = jobs.get(session, jobs.add(session, "fit", method, material_id=material_id, seed=seed))
    context.jobs.submit(job.id)
    return job
