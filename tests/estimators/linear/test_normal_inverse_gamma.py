"""The exact posterior against its definition, and what it says of σ against scipy."""

import numpy as np
import pytest
from scipy import stats

from estimators.defaults import PRIOR, REFERENCE
from estimators.linear.normal_inverse_gamma import NormalInverseGamma, posterior

KNOWN = NormalInverseGamma(np.array([0.5, 2.0]), np.array([[0.1, 0.0], [0.3, 0.2]]), 7.0, 0.05)


def test_the_posterior_adds_the_priors_rows_and_its_sum_of_squares_to_the_data() -> None:
    rng = np.random.default_rng(1)
    x, y = rng.standard_normal((20, 3)), rng.standard_normal(20)
    prior = np.column_stack([np.diag([0.5, 0.2, 0.1]), [0.25, 0.0, 0.0]])
    found = posterior(np.linalg.qr(np.column_stack([x, y]), mode="r"), 20.0, prior)
    precision = x.T @ x + prior[:, :3].T @ prior[:, :3]
    mean = np.linalg.solve(precision, x.T @ y + prior[:, :3].T @ prior[:, 3])
    np.testing.assert_allclose(found.mean, mean, rtol=1e-10)
    np.testing.assert_allclose(found.root @ found.root.T, np.linalg.inv(precision), rtol=1e-10)
    left = ((y - x @ mean) ** 2).sum() + ((prior[:, 3] - prior[:, :3] @ mean) ** 2).sum()
    degrees = PRIOR.degrees_of_freedom + 20.0
    assert found.degrees_of_freedom == degrees
    assert found.scale**2 * degrees == pytest.approx(PRIOR.degrees_of_freedom * REFERENCE.scatter**2 + left, rel=1e-10)
    np.testing.assert_allclose(found.covariance, found.scale**2 * np.linalg.inv(precision), rtol=1e-10)


def test_the_logarithm_of_sigma_has_the_moments_of_its_inverse_gamma() -> None:
    sigma2 = stats.invgamma(3.5, scale=3.5 * 0.05**2)
    mean = sigma2.expect(lambda s: 0.5 * np.log(s))
    square = sigma2.expect(lambda s: (0.5 * np.log(s) - mean) ** 2)
    assert KNOWN.log_scale() == (pytest.approx(mean, rel=1e-6), pytest.approx(np.sqrt(square), rel=1e-4))


def test_draws_are_of_students_t_and_of_the_inverse_gamma() -> None:
    draws = KNOWN.draw(20_000, np.random.default_rng(2))
    away = (draws[:, :2] - KNOWN.mean) / np.sqrt(np.diag(KNOWN.covariance))
    for column in away.T:
        assert stats.kstest(column, stats.t(7.0).cdf).pvalue > 1e-3
    assert stats.kstest(draws[:, 2] ** 2, stats.invgamma(3.5, scale=3.5 * 0.05**2).cdf).pvalue > 1e-3
    assert np.corrcoef(away.T)[0, 1] == pytest.approx(0.3 / np.sqrt(0.13), abs=0.02)
