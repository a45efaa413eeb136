"""Calibration of the hierarchical model by its own priors, and what the draws of it are."""

import numpy as np
import pytest
from scipy import stats

from benchmarks.estimators.prior_calibration import GRASPS, LEVEL, calibrated, drawn, law, p_values, regressors, scales
from estimators.defaults import PRIOR, REFERENCE


@pytest.mark.long
@pytest.mark.parametrize("grasps", GRASPS)
def test_no_truth_lies_in_another_part_of_its_posterior_than_chance_takes_it(grasps: int) -> None:
    assert (p_values(calibrated(grasps, fits=500)) > LEVEL).all()


def test_a_posterior_that_is_too_narrow_or_off_would_be_found_out() -> None:
    score = np.random.default_rng(0).standard_normal((500, 1))
    below = stats.norm.cdf(np.hstack([score, score / 0.6, score + 0.3]))
    right, narrow, off = p_values(below)
    assert right > LEVEL
    assert max(narrow, off) < LEVEL


def test_what_is_drawn_has_the_priors() -> None:
    rng = np.random.default_rng(0)
    x = regressors(3, rng)
    between, places, _ = np.array([scales(rng) for _ in range(2000)]).T
    level = np.array([law(x, rng) for _ in range(2000)]) @ [1.0, *x.mean(axis=(0, 1))]
    for values, prior in (
        (between / PRIOR.grasp_scatter, stats.t(PRIOR.grasp_degrees_of_freedom)),
        (places / REFERENCE.scatter, stats.t(PRIOR.effect_degrees_of_freedom)),
    ):
        assert stats.kstest(values, lambda value, prior=prior: 2.0 * prior.cdf(value) - 1.0).pvalue > LEVEL
    assert stats.kstest(level, stats.norm(REFERENCE.friction, PRIOR.width).cdf).pvalue > LEVEL


def test_a_fit_has_a_part_of_each_posterior_below_its_truth() -> None:
    for sampled in (False, True):
        below = calibrated(2, fits=1, sampled=sampled)
        assert below.shape == (1, 6)
        assert ((below >= 0.0) & (below <= 1.0)).all()
    data, truth = drawn(2, np.random.default_rng(0))
    assert len(data) == 2
    assert np.isfinite(truth).all()
