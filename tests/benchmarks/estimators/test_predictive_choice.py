"""The score by which methods are compared: against its closed form, and false slip as it is made."""

import math

import numpy as np
import pytest
from scipy import stats

from benchmarks.estimators.predictive_choice import PARTS, material, score


def test_the_score_of_a_normal_prediction_is_its_closed_form() -> None:
    """Gneiting & Raftery, 2007, eq. 21; twenty quantiles sum the integral to 1 %."""
    for off in (-1.5, 0.0, 0.4):
        exact = off * (2.0 * stats.norm.cdf(off) - 1.0) + 2.0 * stats.norm.pdf(off) - 1.0 / math.sqrt(math.pi)
        assert score(stats.norm.ppf(PARTS), np.array([off])) == pytest.approx(exact, rel=0.02, abs=0.003)


def test_false_slip_lowers_a_tenth_of_the_ratios_and_nothing_else() -> None:
    (grasp, *_), _ = material("false slip", 3)
    np.testing.assert_allclose(grasp.tangential_force, grasp.friction_coefficient * grasp.normal_force, rtol=1e-12)
    low = np.mean(grasp.friction_coefficient < 0.7 * np.median(grasp.friction_coefficient))
    assert 0.03 < low < 0.1  # those below 0.7 times their friction: six of every ten of a tenth
