"""Jobs: what is waiting, under way and done, and how far; end one that nobody wants."""

from typing import Annotated

from fastapi import APIRouter, Query, Request, Response
from fastapi.responses import RedirectResponse

from db.records import JobStatus
from db.repositories import jobs
from service.domain.jobs.cancel import cancel
from service.http.access import ADMIN, READ, CurrentPrincipal
from service.http.dependencies import CurrentContext
from service.http.fair_route import FairRoute
from service.http.paging import Page
from service.http.schemas.common import CursorText
from service.web.forms import EMPTY_IS_NONE
from service.web.rendering import render

router = APIRouter(include_in_schema=False, route_class=FairRoute)

ON_A_PAGE = 50
STAGES = {
    "ingest": ("frames", "forces", "slip_state", "samples", "friction_model", "material"),
    "fit": ("friction_model",),
}
"""In their order, by the kind of the job (``service.jobs.pipeline``)."""


@router.get("/jobs", dependencies=[READ])
def list_jobs(
    context: CurrentContext,
    request: Request,
    status: Annotated[JobStatus | None, EMPTY_IS_NONE, Query()] = None,
    cursor: CursorText = None,
) -> Response:
    """Newest first."""
    page = Page("-created_at", ON_A_PAGE, cursor, identity="hex")
    with context.database.read() as session:
        found, after = page.cut(jobs.list_all(session, page.window(), status))
    return render(request, "jobs.html", jobs=found, after=after, status=status, stages=STAGES, is_first=cursor is None)


@router.post("/jobs/{id}/cancel", dependencies=[ADMIN])
def cancel_job(context: CurrentContext, id: str, principal: CurrentPrincipal) -> Response:  # noqa: A002  (the path's own name)
    """End a job, and lead back to the list; raises as the API's route does."""
    cancel(context, id, principal)
    return RedirectResponse("/jobs", 303)
