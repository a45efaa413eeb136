"""Which grasp lowers the friction that a planner may count on."""

import numpy as np
import pytest

import estimators
from estimators import InvalidSamples, Moments, WorkingPoint
from estimators.influence import counted_on, most_lowering
from slipcore.samples import FrictionSamples

AT = WorkingPoint(0.12)


def grasp(seed: int, effect: float = 0.0) -> Moments:
    """One grasp of 100 samples whose friction differs by this part, and by 2 % of chance."""
    rng = np.random.default_rng([seed, 41])
    place = np.arange(100) % 10
    v, f_n = rng.uniform(1e-4, 4e-3, 100), rng.uniform(0.05, 0.2, 10)[place]
    mu = (0.5 - 0.4 * f_n) * (1.0 + effect + 0.02 * rng.standard_normal()) + 0.02 * rng.standard_normal(100)
    return Moments.from_samples(FrictionSamples(mu, v, f_n, mu * f_n, v, place, np.ones(100), 1e-6))


@pytest.mark.parametrize(("place", "effect"), [(5, -0.4), (2, -0.4), (1, 0.6)])
def test_an_odd_grasp_is_found_wherever_it_stands_and_whichever_way_it_is_off(place: int, effect: float) -> None:
    grasps = [grasp(k, effect if k == place else 0.0) for k in range(6)]
    found = most_lowering(estimators.fit(grasps, "hierarchical"), grasps, AT)
    assert found is not None
    assert found.place == place
    assert found.effect * effect > 0.0
    rest = [part for k, part in enumerate(grasps) if k != place]
    assert found.without == counted_on(estimators.fit(rest, "hierarchical"), AT)
    assert found.friction == counted_on(estimators.fit(grasps, "hierarchical"), AT)
    assert found.without > 1.3 * found.friction


def test_no_grasp_is_named_where_each_makes_friction_better_known() -> None:
    grasps = [grasp(0) for _ in range(6)]
    assert most_lowering(estimators.fit(grasps, "hierarchical"), grasps, AT) is None


def test_a_model_without_scales_is_refused() -> None:
    grasps = [grasp(k) for k in range(3)]
    with pytest.raises(InvalidSamples, match="without scales"):
        most_lowering(estimators.fit(grasps, "ols"), grasps, AT)
