from dataclasses import replace

import pytest

from slipcore import GraspLog, recommended_method
from slipcore.contact.tiers.ramp import tangential_ramp
from slipcore.frames import RECONSTRUCTED


def log(points: int) -> GraspLog:
    return tangential_ramp(points=points, pitch=12e-3 / points)


@pytest.mark.parametrize(("points", "method"), [(3, "coarse"), (6, "coarse"), (7, "filter"), (20, "filter")])
def test_few_elements_that_measure_displacement_and_forces_are_left_to_coarse(points: int, method: str) -> None:
    assert recommended_method(log(points)) == method


def test_without_forces_of_their_own_few_elements_are_left_to_the_filter() -> None:
    few = log(4)
    assert recommended_method(replace(few, force=None)) == "filter"
    assert recommended_method(replace(few, metadata={"force": RECONSTRUCTED})) == "filter"


@pytest.mark.parametrize("points", [3, 20])
def test_forces_alone_are_left_to_the_method_for_them(points: int) -> None:
    assert recommended_method(replace(log(points), displacement=None)) == "forces_only"
