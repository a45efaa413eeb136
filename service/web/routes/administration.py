"""What admins look at: access keys, and who changed what."""

from typing import Annotated
from urllib.parse import urlencode

from fastapi import APIRouter, Query, Request, Response

from db.records import AuditFilter
from db.repositories import access_keys, audit
from service.domain.access.keys import is_valid
from service.http.access import ADMIN
from service.http.dependencies import CurrentContext
from service.http.fair_route import FairRoute
from service.http.paging import Page
from service.http.schemas.common import CursorText
from service.web.rendering import render

router = APIRouter(include_in_schema=False, route_class=FairRoute)

ENTRIES_ON_A_PAGE = 50


@router.get("/keys", dependencies=[ADMIN])
def list_keys(context: CurrentContext, request: Request) -> Response:
    """All, the revoked and expired ones too; of the keys themselves only digests are stored."""
    with context.database.read() as session:
        found = access_keys.list_all(session)
    return render(request, "keys.html", keys=[(key, is_valid(key)) for key in found])


@router.get("/audit", dependencies=[ADMIN])
def list_audit_entries(
    context: CurrentContext,
    request: Request,
    actor: Annotated[str, Query(max_length=120)] = "",
    action: Annotated[str, Query(max_length=50)] = "",
    subject: Annotated[str, Query(max_length=200)] = "",
    cursor: CursorText = None,
) -> Response:
    """Newest first; raises as the API's route does."""
    page = Page("-id", ENTRIES_ON_A_PAGE, cursor)
    asked = {"actor": actor.strip(), "action": action.strip(), "subject": subject.strip()}
    wanted = AuditFilter(**{name: text or None for name, text in asked.items()})
    with context.database.read() as session:
        found, after = page.cut(audit.list_all(session, page.window(), wanted))
    older = None if after is None else f"/audit?{urlencode(asked | {'cursor': after})}"
    return render(request, "audit.html", entries=found, asked=asked, older=older, is_first=cursor is None)
