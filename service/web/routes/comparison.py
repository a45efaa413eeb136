"""Models of several materials, or several versions, in one picture."""

from collections.abc import Sequence
from typing import Annotated, Any

from fastapi import APIRouter, Query, Request, Response

from db.records import StoredModel
from db.repositories import friction_models, materials
from service.domain.resources.context import Context
from service.http.access import READ
from service.http.dependencies import CurrentContext
from service.http.fair_route import FairRoute
from service.http.problems import INVALID_REQUEST, Problem
from service.web.comparison import MOST_COMPARED, common_force, compare, picture
from service.web.friction import usual_model
from service.web.materials import names
from service.web.working_point import PageQuery, shown_at

router = APIRouter(include_in_schema=False, route_class=FairRoute)

Names = Annotated[list[str], Query(default_factory=list, max_length=MOST_COMPARED + 1)]  # and the field for one more
Ids = Annotated[list[Annotated[int, Query(ge=1, le=2**53)]], Query(default_factory=list, max_length=MOST_COMPARED)]


@router.get("/compare", dependencies=[READ])
def compare_models(context: CurrentContext, request: Request, material: Names, model: Ids) -> Response:
    """The usual models of the materials named, and the versions chosen, at normal force ``fn``.

    Raises ``NotFound``, ``Problem``.
    """
    wanted = list(dict.fromkeys(name for name in material if name))
    without, found = _models(context, wanted, model)
    if len(found) > MOST_COMPARED:
        raise Problem.wrong_value(INVALID_REQUEST, "models", len(found), f"{MOST_COMPARED} in one picture")

    def show(at: PageQuery) -> dict[str, Any]:
        force = None if not found else common_force(found) if at.fn is None else at.fn
        return {
            "compared": [] if force is None else compare(found, force),
            "chart": None if force is None else picture(found, force),
            "force": force,
            "asked": {"materials": wanted, "models": model, "fn": at.typed()["fn"]},
        }

    return shown_at(request, "compare.html", show, without=without, names=names(context), most=MOST_COMPARED)


def _models(context: Context, wanted: Sequence[str], ids: Sequence[int]) -> tuple[list[str], list[StoredModel]]:
    """Names of materials that have no model, and the models, each once."""
    with context.database.read() as session:
        usual = {name: usual_model(materials.get(session, name).models) for name in wanted}
        versions = friction_models.with_ids(session, ids)
    found = {stored.id: stored for stored in (*usual.values(), *versions) if stored is not None}
    return [name for name, stored in usual.items() if stored is None], list(found.values())
