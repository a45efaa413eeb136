"""The demo's simulated grasps, for who has none of his own yet."""

from fastapi import APIRouter, Response
from fastapi.responses import RedirectResponse

from service.domain.uploads.practice import load_practice
from service.http.access import UPLOAD, CurrentPrincipal
from service.http.dependencies import CurrentContext

router = APIRouter(include_in_schema=False)


@router.post("/practice", dependencies=[UPLOAD])
async def load(context: CurrentContext, principal: CurrentPrincipal) -> Response:
    """Upload them, and lead to their jobs; raises as an upload does."""
    await load_practice(context, principal)
    return RedirectResponse("/jobs", 303)
