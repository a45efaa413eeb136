"""The API's description as a page: Swagger UI, from files that are served here."""

from fastapi import APIRouter, Request, Response
from fastapi.responses import RedirectResponse

from service.http.fair_route import FairRoute
from service.web.rendering import SWAGGER_UI_POLICY, render

router = APIRouter(include_in_schema=False, route_class=FairRoute)


@router.get("/docs")
def show_api(request: Request) -> Response:
    """All routes, with their shapes and examples, to be tried out."""
    page = render(request, "api_docs.html")
    page.headers["Content-Security-Policy"] = SWAGGER_UI_POLICY
    return page


@router.get("/redoc")
async def lead_to_api() -> Response:
    """Where the same was shown once more by another program."""
    return RedirectResponse("/docs", 308)
