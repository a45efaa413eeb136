"""How hard to grip: the planner's question as a form."""

from typing import Any

from fastapi import APIRouter, Request, Response

from service.domain import plan
from service.http.access import READ
from service.http.dependencies import CurrentContext
from service.http.schemas.planning import NewGraspForce
from service.web.forms import checked
from service.web.materials import names
from service.web.rendering import on_problem, render

router = APIRouter(include_in_schema=False)

FIELDS = frozenset(NewGraspForce.model_fields)


@router.get("/plan", dependencies=[READ])
def show_plan(context: CurrentContext, request: Request) -> Response:
    """The form, and what it was last asked; raises as the API's route does."""
    fields = {name: text for name, text in request.query_params.items() if name in FIELDS}
    given: dict[str, Any] = {"fields": fields, "names": names(context), "answer": None}
    on_problem(request, "plan.html", **given)
    answer = plan.grasp_force(context, checked(NewGraspForce, fields).task()) if fields.get("tangential_load") else None
    return render(request, "plan.html", **given | {"answer": answer}, problem=None)
