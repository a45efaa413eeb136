"""Jobs."""

from typing import Annotated, Literal

from fastapi import APIRouter, Query, Request, Response

from db.records import JobStatus
from db.repositories import jobs
from service.domain.jobs.await_job import MOST_SECONDS, await_job
from service.domain.jobs.cancel import cancel
from service.http.access import ADMIN, READ, CurrentPrincipal
from service.http.dependencies import CurrentContext
from service.http.descriptions import problems
from service.http.fair_route import FairRoute
from service.http.paging import Page, link_next
from service.http.problems import INVALID_REQUEST, JOB_ENDED, STORAGE_UNAVAILABLE, UNKNOWN_JOB
from service.http.schemas.common import USUAL, CursorText, Limit
from service.http.schemas.jobs import JobOut, JobsOut

router = APIRouter(prefix="/v1/jobs", tags=["jobs"], route_class=FairRoute)


@router.get("", dependencies=[READ], summary="List jobs", responses=problems(INVALID_REQUEST, STORAGE_UNAVAILABLE))
def list_jobs(
    context: CurrentContext,
    request: Request,
    response: Response,
    status: Annotated[JobStatus | None, Query(description="Only those of it, such as `failed`")] = None,
    sort: Annotated[
        Literal["created_at", "-created_at"], Query(description="By what; `-` for the last ones first")
    ] = "-created_at",
    limit: Limit = USUAL,
    cursor: CursorText = None,
) -> JobsOut:
    """Each with how far it is and why it ended."""
    page = Page(sort, limit, cursor, identity="hex")
    with context.database.read() as session:
        found, after = page.cut(jobs.list_all(session, page.window(), status))
    if ended := [(job.id, job.finished_at) for job in found if job.finished_at is not None]:
        context.models.seen(*ended)
    return JobsOut(items=[JobOut.of(job) for job in found], next=link_next(request, response, after))


@router.get(
    "/{id}",
    dependencies=[READ],
    summary="Look at a job",
    responses=problems(UNKNOWN_JOB, INVALID_REQUEST, STORAGE_UNAVAILABLE),
)
async def read_job(
    context: CurrentContext,
    principal: CurrentPrincipal,
    id: str,  # noqa: A002  (the path's own name)
    wait: Annotated[float, Query(ge=0.0, le=MOST_SECONDS, description="s to wait for its end", examples=[10.0])] = 0.0,
) -> JobOut:
    """How far it is, what each stage took, and why it ended as it did.

    With `wait` the answer comes at the job's end, or after so many seconds: who wants its result asks once, not again
    and again.
    """
    return JobOut.of(await await_job(context, id, wait, principal))


@router.post(
    "/{id}/cancel",
    dependencies=[ADMIN],
    summary="Cancel a job",
    responses=problems(UNKNOWN_JOB, JOB_ENDED, INVALID_REQUEST, STORAGE_UNAVAILABLE),
)
def cancel_job(context: CurrentContext, id: str, principal: CurrentPrincipal) -> JobOut:  # noqa: A002
    """It stores nothing more; a worker that is at it turns to the next one after the stage that it is in."""
    return JobOut.of(cancel(context, id, principal))
