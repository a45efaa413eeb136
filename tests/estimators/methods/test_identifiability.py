"""When a coefficient counts as known."""

from collections.abc import Callable

import numpy as np
import pytest
from scipy import stats

from estimators.defaults import IDENTIFIABILITY, REFERENCE
from estimators.linear.fit_data import gather
from estimators.methods.identifiability import effects, identifiable
from slipcore.samples import FrictionSamples

Make = Callable[..., FrictionSamples]

SMALL, LARGE = IDENTIFIABILITY.effect, np.nextafter(IDENTIFIABILITY.effect, 1.0)
OWN, PRIORS = IDENTIFIABILITY.prior_shift, np.nextafter(IDENTIFIABILITY.prior_shift, 1.0)


@pytest.mark.parametrize(
    ("effect", "prior_shift", "known"),
    [(SMALL, OWN, True), (LARGE, OWN, False), (SMALL, PRIORS, False), (LARGE, PRIORS, False), (0.0, 0.0, True)],
)
def test_a_known_coefficient_has_little_effect_and_owes_the_prior_little(
    effect: float, prior_shift: float, known: bool
) -> None:
    assert identifiable(np.full(3, effect), np.full(3, prior_shift)).tolist() == [known] * 3


def test_each_coefficient_is_judged_by_itself() -> None:
    assert identifiable(np.array([SMALL, LARGE, SMALL]), np.array([OWN, OWN, PRIORS])).tolist() == [True, False, False]


@pytest.mark.parametrize("fastest", [1e-3, 20e-3])
def test_the_effect_is_the_interval_over_the_larger_of_span_and_range(samples: Make, fastest: float) -> None:
    data = gather(samples(50, tangential_velocity=np.linspace(0.0, fastest, 50)))
    deviation = np.array([0.02, 3.0, 0.5])
    span = [
        1.0,
        max(fastest, REFERENCE.tangential_velocity),
        max(data.domain.normal_force[1], REFERENCE.pressure * 1e-6),
    ]
    expected = stats.t(7).ppf(0.975) * deviation * span / data.mean_friction
    np.testing.assert_allclose(effects(np.diag(deviation**2), 7.0, data), expected, rtol=1e-12)


def test_friction_of_the_other_sign_does_not_turn_effects_round(samples: Make) -> None:
    data, mirrored = (gather(samples(50, scale=0.0, coefficients=np.array([mean, 0.0, 0.0]))) for mean in (0.5, -0.5))
    np.testing.assert_allclose(effects(np.eye(3), 5.0, mirrored), effects(np.eye(3), 5.0, data), rtol=1e-12)
