"""What pages call the fields of their forms, and the values that are wrong in them."""

import pytest

from service.http.schemas.planning import NewGraspForce
from service.http.schemas.sensors import GelIn
from service.web.labels import label, labelled_detail


@pytest.mark.parametrize("shape", [NewGraspForce, GelIn])
def test_each_field_of_a_form_has_a_label(shape: type[NewGraspForce | GelIn]) -> None:
    in_no_form = {"relative_thickness"}
    assert {name for name in shape.model_fields if label(name) == name} <= in_no_form


@pytest.mark.parametrize(
    ("problem", "told"),
    [
        ({"name": "torque", "detail": "torque is x"}, "“Torque of all fingers together, N·m” is x"),
        ({"name": "columns", "detail": "columns is 3; allowed: 4"}, "columns is 3; allowed: 4"),
        ({"name": "scale", "detail": "no force holds: scale is 1"}, "no force holds: scale is 1"),
        ({"name": None, "detail": "None is known"}, "None is known"),
        ({"detail": "a disk is full"}, "a disk is full"),
    ],
)
def test_a_problem_calls_what_is_wrong_as_the_form_does(problem: dict[str, str | None], told: str) -> None:
    assert labelled_detail(problem) == told
