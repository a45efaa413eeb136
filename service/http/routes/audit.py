"""Who changed what."""

from typing import Annotated

from fastapi import APIRouter, Query, Request, Response

from db.records import AuditFilter
from db.repositories import audit
from service.http.access import ADMIN
from service.http.dependencies import CurrentContext
from service.http.descriptions import problems
from service.http.fair_route import FairRoute
from service.http.paging import Page, link_next
from service.http.problems import INVALID_REQUEST, STORAGE_UNAVAILABLE
from service.http.schemas.audit import AuditEntryOut, AuditOut
from service.http.schemas.common import USUAL, CursorText, Limit

router = APIRouter(prefix="/v1/audit", tags=["audit"], route_class=FairRoute)


@router.get(
    "", dependencies=[ADMIN], summary="Look who changed what", responses=problems(INVALID_REQUEST, STORAGE_UNAVAILABLE)
)
def list_audit_entries(
    context: CurrentContext,
    request: Request,
    response: Response,
    actor: Annotated[
        str | None, Query(max_length=120, description="Only what it did", examples=["key:3f9c2a7b51de"])
    ] = None,
    action: Annotated[
        str | None, Query(max_length=50, description="Only this", examples=["grasp_log.withdrawn"])
    ] = None,
    subject: Annotated[
        str | None, Query(max_length=200, description="Only what was done to it", examples=["paper"])
    ] = None,
    limit: Limit = USUAL,
    cursor: CursorText = None,
) -> AuditOut:
    """Newest first."""
    page = Page("-id", limit, cursor)
    with context.database.read() as session:
        found, after = page.cut(audit.list_all(session, page.window(), AuditFilter(actor, action, subject)))
    return AuditOut(items=[AuditEntryOut.of(each) for each in found], next=link_next(request, response, after))
