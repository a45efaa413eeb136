"""What is taken where a planner does not say it, wherever it is asked."""

import pytest

from estimators.defaults import DESIGN
from service.http.schemas.models import NextGraspQuery


@pytest.mark.parametrize("name", ["quantile", "elements", "drop_probability"])
def test_the_web_asks_for_the_same_grasp_as_the_package(name: str) -> None:
    assert getattr(NextGraspQuery(), name) == getattr(DESIGN, name)
