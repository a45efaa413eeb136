import dataclasses
import math

import numpy as np
import pytest

from benchmarks.control.episodes import START, Task, world_of
from benchmarks.control.recognition import SEEN_FRAMES, Grasp, TruePhysics, counted, grasp
from benchmarks.control.tasks import LIFTS
from slipcore.contact.reduced import Load

SLIPPERY = LIFTS[0]


def test_true_slip_is_none_at_rest_and_all_in_an_overloaded_contact() -> None:
    world = dataclasses.replace(world_of(SLIPPERY, 0), friction=np.full((1, 20, 20), 0.3))
    physics, command, generator = TruePhysics(), np.array([START]), np.random.default_rng(0)
    state = physics.init(world, START)
    for supported in (1.0, 0.9, 0.0):  # the last one leaves 1 N, where 0.3 N can be borne
        state = physics.step(world, state, command, Load(0.1, supported), 1 / 60)
        physics.observe(world, state, 0, generator)
    assert physics.slipping[0] == 0
    assert physics.slipping[0] <= physics.slipping[1] < physics.slipping[2]
    assert physics.stick_ratio(world, state, 0) == 0.0


@pytest.mark.parametrize("lifted", [LIFTS[2], *(pytest.param(LIFTS[k], marks=pytest.mark.long) for k in (7, 11))])
def test_what_slips_under_a_force_that_is_held_still_shows_the_material_within_a_second(lifted: Task) -> None:
    """1.5 N at μ = 0.3, 2 N at 0.45 and 0.7: under a force that grew with the load hardly anything slipped.

    How much slips depends on the field of friction: of six contacts a third may show too little in that time.
    """
    found = [grasp(dataclasses.replace(lifted, seconds=1.6), seed) for seed in range(10500, 10506)]
    assert {each.named for each in found} <= {f"{lifted.friction[0]:g}", None}
    in_time = [each for each in found if each.after <= 1.0]
    assert len(in_time) >= 4
    assert min(each.frames for each in in_time) >= SEEN_FRAMES
    assert all(each.held for each in found)


def test_grasps_are_counted_by_what_was_named_and_when() -> None:
    right, late = Grasp(0.3, "0.3", 0.4, 12, 0.9, held=True), Grasp(0.3, "0.3", 2.0, 4, 0.7, held=True)
    other, never = Grasp(0.3, "0.45", 0.5, 0, 0.8, held=False), Grasp(0.3, None, math.inf, 0, 0.6, held=True)
    row = counted(0.3, [right, late, other, never])
    asked = {"named": "1/4", "ever": "2/4", "wrong": "1/4", "slips": "2/4", "lasts": "1/4", "used": 0.75, "held": "3/4"}
    assert row == {"friction": 0.3} | asked
