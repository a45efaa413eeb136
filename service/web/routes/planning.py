"""How hard to grip: the planner's question as a form."""

from typing import Any

from fastapi import APIRouter, Request, Response

from estimators.method_names import PLANNING_METHODS
from service.domain.planning import plan
from service.formatting import further_warning
from service.http.access import READ
from service.http.dependencies import CurrentContext
from service.http.fair_route import FairRoute
from service.http.schemas.planning import NewGraspForce
from service.web.force_curve import draw_forces, probabilities
from service.web.forms import checked
from service.web.materials import names
from service.web.rendering import on_problem, render

router = APIRouter(include_in_schema=False, route_class=FairRoute)

FIELDS = frozenset(NewGraspForce.model_fields)

ALWAYS_SHOWN = {"material", "tangential_load", "contact_area", "fingers", "torque", "slip_probability"}
"""Fields of the form; the others are folded away until one of them is asked for."""


@router.get("/plan", dependencies=[READ])
def show_plan(context: CurrentContext, request: Request) -> Response:
    """The form, what it was last asked, and forces for other probabilities of slip; raises as the API's route does."""
    fields = {name: text for name, text in request.query_params.items() if name in FIELDS}
    given: dict[str, Any] = {"fields": fields, "names": names(context), "methods": PLANNING_METHODS}
    more = {fields[name] for name in fields.keys() - ALWAYS_SHOWN} - {"", "auto"}
    given |= {"answer": None, "chart": None, "more": bool(more)}
    on_problem(request, "plan.html", **given)
    if not fields.get("tangential_load"):
        return render(request, "plan.html", **given, problem=None)
    task = checked(NewGraspForce, fields).task()
    curve = plan.force_curve(context, task, probabilities(task.slip_probability))
    given |= {"chart": draw_forces(curve, task.slip_probability)}
    on_problem(request, "plan.html", **given)
    answer = plan.grasp_force(context, task)
    given |= {"answer": answer, "further": further_warning(answer.warning, answer.advice)}
    return render(request, "plan.html", **given, problem=None)
