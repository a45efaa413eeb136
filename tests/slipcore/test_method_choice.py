from dataclasses import replace

import pytest

from slipcore import GraspLog, detect_slip, recommended_method
from slipcore.contact.tiers.ramp import RampSchedule, tangential_ramp
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


@pytest.mark.parametrize("points", [3, 4, 6])
def test_by_the_method_for_them_few_elements_that_are_held_still_do_not_slip(points: int) -> None:
    """Under .6 of friction for 10 s; of 4 × 4 elements ``filter`` says that all slip."""
    schedule = RampSchedule(rest=0.5, press=0.5, settle=0.3, shear=1.0, hold=10.0)
    noise = {"marker_noise": 5e-6, "force_noise": 1e-2, "seed": 3}
    load = {"normal_force": 6.0, "tangential_force": 0.6, "frame_rate": 200.0}
    held = tangential_ramp(points=points, pitch=12e-3 / points, schedule=schedule, **load, **noise)
    assert held.truth is not None
    found = detect_slip(held, recommended_method(held))
    sticks = held.truth.contact & ~held.truth.slip_contact_factor & (held.time > 3.0)[:, None, None]
    assert sticks.sum() > 1000
    assert not found.slip[sticks].any()
    assert not found.macro_slip[held.time > 3.0].any()
