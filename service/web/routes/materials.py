"""Materials: all of them, and one."""

from typing import Annotated, Literal
from urllib.parse import quote

from fastapi import APIRouter, Query, Request, Response
from fastapi.params import Form
from fastapi.responses import RedirectResponse

from db.repositories import materials
from service.context import Given
from service.domain import curate
from service.http.access import READ, UPLOAD, Asking
from service.http.paging import CursorText, Page
from service.http.schemas.common import Force
from service.http.schemas.materials import NewMaterial
from service.web.forms import EMPTY_IS_NONE, checked
from service.web.friction import listed
from service.web.rendering import render

router = APIRouter(include_in_schema=False)

ON_A_PAGE = 50

ForceOrEmpty = Annotated[Force | None, EMPTY_IS_NONE, Query()]


@router.get("/", dependencies=[READ])
def list_materials(
    context: Given,
    request: Request,
    search: Annotated[str, Query(max_length=100)] = "",
    sort: Literal["name", "-name", "created_at", "-created_at"] = "name",
    fn: ForceOrEmpty = None,
    cursor: CursorText = None,
) -> Response:
    """Friction at a working point of all whose name has the search in it; a greeting where there is no material yet."""
    page = Page(sort, ON_A_PAGE, cursor)
    with context.database.read() as session:
        found, after = page.cut(materials.list_all(session, page.window(), search or None))
    if not found and not search and cursor is None:
        return render(request, "welcome.html")
    rows = [listed(each, fn) for each in found]
    asked = {"search": search, "sort": sort, "fn": "" if fn is None else f"{fn:g}"}
    return render(request, "materials.html", rows=rows, asked=asked, after=after, is_first=cursor is None)


@router.post("/materials", dependencies=[UPLOAD])
def create_material(
    context: Given,
    asker: Asking,
    name: Annotated[str, Form(max_length=200)] = "",
    description: Annotated[str, Form(max_length=20_000)] = "",
) -> Response:
    """Make a material known; raises as the API's route does."""
    new = checked(NewMaterial, {"name": name.strip(), "description": description.strip()})
    with context.database.write() as session:
        curate.create(session, new.name, new.description, asker)
    return RedirectResponse(f"/materials/{quote(new.name, safe='')}", 303)
