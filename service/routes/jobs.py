"""Jobs."""

from fastapi import APIRouter

from db.repositories import jobs
from service.access import READ
from service.context import Given
from service.problems import INVALID_REQUEST, STORAGE_UNAVAILABLE, UNKNOWN_JOB
from service.routes.common import problems
from service.schemas import JobOut

router = APIRouter(prefix="/v1/jobs", tags=["jobs"])


@router.get(
    "/{id}",
    dependencies=[READ],
    summary="Look at a job",
    responses=problems(UNKNOWN_JOB, INVALID_REQUEST, STORAGE_UNAVAILABLE),
)
def read_job(context: Given, id: str) -> JobOut:  # noqa: A002  (the path's own name)
    """How far it is, what each stage took, and why it ended as it did."""
    with context.database.read() as session:
        job = jobs.get(session, id)
    if job.finished_at is not None:
        context.models.seen(job.finished_at)
    return JobOut.of(job)
