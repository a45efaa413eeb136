"""How a change of the load is shared, in closed form."""

from functools import cache

import numpy as np

from slipcore.defaults import ForcesOnlyOptions
from slipcore.detection.forces_only.sharing import Loads, compare, evenly, slip_density, stick_density
from slipcore.detection.forces_only.tuning import ForcesTuning, considered, forces_tuning

PLACE = 1e-3 * np.array([[0.0, 0.0], [4.0, 0.0], [0.0, 3.0], [5.0, 5.0], [-2.0, 1.0]])
NORMAL = np.array([0.5, 1.0, 0.2, 0.4, 0.9])


@cache
def options() -> ForcesTuning:
    return forces_tuning(considered(ForcesOnlyOptions()).settings)


def loads(ratio: np.ndarray) -> Loads:
    return Loads(PLACE, NORMAL, NORMAL[:, None] * ratio)


def rigid(x: float, y: float, turn: float) -> np.ndarray:
    """Force ratios as of springs in proportion to the normal force under a plate that moves and turns."""
    arm = PLACE - (NORMAL[:, None] * PLACE).sum(axis=0) / NORMAL.sum()
    return np.stack([x - turn * arm[:, 1], y + turn * arm[:, 0], np.zeros(5)], axis=-1)


def test_a_load_that_is_shared_by_the_normal_force_is_told_exactly_with_its_torque() -> None:
    ratio = rigid(0.2, -0.1, 30.0)
    np.testing.assert_allclose(evenly(loads(ratio)), ratio, rtol=1e-12, atol=1e-15)


def test_elements_that_go_on_sharing_as_before_take_their_whole_part() -> None:
    uneven = np.array([0.5, 1.0, 2.0, 1.5, 0.8])[:, None]
    seen = compare(
        loads(0.5 * uneven * rigid(0.2, 0.1, 0.0)), loads(0.6 * uneven * rigid(0.2, 0.1, 0.0)), 0.0, options()
    )
    np.testing.assert_allclose(seen.part, 1.0, rtol=1e-9)
    assert (seen.expected > 0.0).all()
    assert not seen.falls.any()


def test_an_element_at_its_limit_takes_nothing_more_and_is_told_from_those_that_do() -> None:
    before, now = rigid(0.3, 0.0, 0.0), rigid(0.35, 0.0, 0.0)
    now[2] = before[2]
    seen = compare(loads(before), loads(now), 0.0, options())
    assert abs(seen.part[2]) < 1e-9
    gained = (slip_density(seen, np.array([0.3]), options()) - stick_density(seen, options()))[0]
    assert gained[2] > 2.0
    assert np.delete(gained, 2).max() < 0.0


def test_noise_takes_its_share_of_what_is_told() -> None:
    before, now = rigid(0.3, 0.0, 0.0), rigid(0.35, 0.0, 0.0)
    now[2] = before[2]
    told = [
        (slip_density(seen, np.array([0.3]), options()) - stick_density(seen, options()))[0, 2]
        for noise in (0.0, 3e-3, 3e-2)
        for seen in [compare(loads(before), loads(now), noise, options())]
    ]
    assert told[0] > told[1] > told[2]
    assert abs(told[2]) < 0.3
