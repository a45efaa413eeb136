"""What the types of problems mean, at the addresses that problems name."""

from fastapi import APIRouter, Request, Response
from starlette.exceptions import HTTPException

from service.http.fair_route import FairRoute
from service.http.problem_meanings import MEANINGS
from service.http.problems import PROBLEM_TYPES
from service.web.rendering import render

router = APIRouter(include_in_schema=False, route_class=FairRoute)


@router.get("/problems")
def list_problems(request: Request) -> Response:
    """All types."""
    return render(request, "problems.html", types=PROBLEM_TYPES.values(), meanings=MEANINGS)


@router.get("/problems/{name}")
def show_problem(request: Request, name: str) -> Response:
    """One type."""
    if name not in PROBLEM_TYPES:
        raise HTTPException(404, "there is no such type of problem")
    return render(request, "problems.html", types=[PROBLEM_TYPES[name]], meanings=MEANINGS)
