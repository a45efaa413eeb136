"""Cancel a job that nobody wants any more."""

from db.records import Job
from db.repositories import jobs
from service.domain.access.changes import record
from service.domain.access.principal import ANONYMOUS, Principal
from service.domain.errors import JobEnded
from service.domain.resources.context import Context

REASON = "cancelled by request"


def cancel(context: Context, job_id: str, principal: Principal = ANONYMOUS) -> Job:
    """End a job before its time, or find it cancelled; raises ``NotFound``, and ``JobEnded`` if it ended otherwise."""
    with context.database.write() as session:
        was_running = jobs.get(session, job_id).finished_at is None
        job = jobs.cancel(session, job_id, REASON)
        if was_running and job.status == "cancelled":
            record(session, principal, "job.cancelled", job_id, {"material": job.material})
    if job.status != "cancelled":
        raise JobEnded(job_id, job.status)
    return job
