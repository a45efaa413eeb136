"""What draws of a posterior amount to, in closed form."""

import numpy as np
import pytest

from estimators import Domain
from estimators.likelihoods.posterior import Whitening, bounded_exp, corners, scatter, supported


def test_the_scatter_has_the_mean_and_the_spread_of_one_over_the_variance() -> None:
    """Of 1 and 3: mean 2 and variance 1, so that 2 · 2²/1 degrees of freedom match."""
    scale, freedom = scatter(np.array([1.0, 1.0 / 3.0]))
    assert (scale, freedom) == (pytest.approx(2.0**-0.5), pytest.approx(8.0))
    assert scatter(np.full(3, 4.0)) == (pytest.approx(2.0), pytest.approx(2e12))


def test_corners_of_a_domain_are_all_four() -> None:
    found = corners(Domain((1.0, 2.0), (3.0, 4.0)))
    assert found.tolist() == [[1.0, 1.0, 3.0], [1.0, 1.0, 4.0], [1.0, 2.0, 3.0], [1.0, 2.0, 4.0]]


def test_a_density_ends_where_friction_is_not_above_zero_at_some_corner() -> None:
    at = np.array([[1.0, 0.0, 0.0], [1.0, 1.0, 0.0]])
    beta = np.array([[0.5, -0.4, 0.0], [0.5, -0.5, 0.0], [-0.1, 0.5, 0.0]])
    np.testing.assert_array_equal(supported(np.arange(3.0), beta, at), [0.0, -np.inf, -np.inf])


def test_whitening_is_affine() -> None:
    map_back = Whitening(np.array([1.0, 2.0]), np.array([[2.0, 0.0], [1.0, 3.0]]))
    np.testing.assert_allclose(map_back(np.array([[1.0, 1.0], [0.0, -1.0]])), [[3.0, 6.0], [1.0, -1.0]])


def test_an_exponential_is_finite_and_above_zero_everywhere() -> None:
    found = bounded_exp(np.array([-1e6, -2.0, 0.0, 1e6]))
    assert found[0] > 0.0
    assert np.isfinite(found[3])
    np.testing.assert_allclose(found[1:3], [0.1353352832366127, 1.0], rtol=1e-15)
