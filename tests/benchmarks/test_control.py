import dataclasses
import math

import numpy as np
import pytest

from benchmarks.control import STRATEGIES, scores
from benchmarks.control_tasks import TASKS, contact_of, least_force, run, world_of
from slipcore.contact.reduced import Load


def test_the_least_force_is_the_limit_surface_s() -> None:
    world = dataclasses.replace(world_of(0.45, 0), friction=np.full((1, 20, 20), 0.45))
    assert least_force(world, Load(0.1), contact_of(world)) == pytest.approx(0.981 / 0.45, rel=1e-9)
    force = least_force(world, Load(0.1, moment=2e-3), contact_of(world))
    arm = float(contact_of(world).arm(force))
    assert math.hypot(0.981, 2e-3 / arm) == pytest.approx(0.45 * force, rel=1e-6)


@pytest.mark.parametrize("name", ["known", "unknown"])
def test_the_controller_holds_a_lift_seen_by_the_real_detector(name: str) -> None:
    task = dataclasses.replace(TASKS[0], seconds=2.5)
    world = world_of(task.friction, 0)
    score = scores(name, [run(task, world, STRATEGIES[name](task, world), 0)])
    assert score["held"] == "1/1"
    assert 1.0 < float(str(score["final"])) < 1.35
