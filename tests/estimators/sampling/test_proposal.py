"""Proposals: densities that integrate to one, and mixtures that reach what one component does not."""

import numpy as np
import pytest
from scipy import stats

from estimators.sampling.adaptation import adapted
from estimators.sampling.proposal import StudentMixture, evenness, standard

TWO = StudentMixture(np.array([0.3, 0.7]), np.array([[0.0], [4.0]]), np.array([[[1.0]], [[0.5]]]))


def test_density_and_draws_are_those_of_the_mixture() -> None:
    x = np.linspace(-6.0, 9.0, 31)
    wanted = 0.3 * stats.t(10.0).pdf(x) + 0.7 * stats.t(10.0, 4.0, 0.5).pdf(x)
    found = np.exp(TWO.log_density(x[:, None]))
    np.testing.assert_allclose(found / found[0], wanted / wanted[0], rtol=1e-10)
    draws = TWO.draw(np.random.default_rng(0), 20_000)[:, 0]
    law = lambda q: 0.3 * stats.t(10.0).cdf(q) + 0.7 * stats.t(10.0, 4.0, 0.5).cdf(q)  # noqa: E731
    assert stats.kstest(draws, law).pvalue > 1e-3


@pytest.mark.parametrize("size", [1, 3])
def test_one_component_is_students_t(size: int) -> None:
    x = np.random.default_rng(0).standard_normal((5, size))
    wanted = stats.multivariate_t(np.zeros(size), np.eye(size), 10.0).logpdf(x)
    found = standard(size).log_density(x)
    np.testing.assert_allclose(found - found[0], wanted - wanted[0], rtol=1e-10, atol=1e-12)


def test_a_bent_density_with_two_peaks_is_matched_by_a_mixture() -> None:
    def log_density(x: np.ndarray) -> np.ndarray:
        bent = -0.5 * (x[:, 0] ** 2 / 4.0 + (x[:, 1] - 0.5 * x[:, 0] ** 2) ** 2)
        return np.asarray(np.logaddexp(bent, -0.5 * ((x[:, 0] - 3.0) ** 2 + (x[:, 1] + 4.0) ** 2)))

    rng = np.random.default_rng(0)
    x = standard(2).draw(rng, 4000)
    alone = evenness(log_density(x) - standard(2).log_density(x))
    fit = adapted(log_density, 2, rng)
    assert alone < 0.2
    assert fit.even > max(3.0 * alone, 0.5)
    near = fit.proposal.draw(rng, 4000)
    assert 0.1 < np.mean(near[:, 1] < -2.0) < 0.6  # a third of the mass is in the second peak
