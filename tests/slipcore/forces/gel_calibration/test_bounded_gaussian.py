"""A Gaussian through a few points of a log density: exact for a quadratic, within bounds, and where nothing falls."""

import numpy as np
import pytest
from scipy import stats

from slipcore.forces.gel_calibration.bounded_gaussian import BoundedGaussian, through

MEAN = np.array([1.0, -2.0])
COVARIANCE = np.array([[0.04, 0.03], [0.03, 0.09]])
FAR = np.full(2, 50.0)


def quadratic(points: np.ndarray) -> np.ndarray:
    return stats.multivariate_normal(MEAN, COVARIANCE).logpdf(points)


@pytest.fixture
def points() -> np.ndarray:
    return MEAN + 0.3 * np.random.default_rng(0).uniform(-1.0, 1.0, (12, 2))


def test_of_a_quadratic_mean_and_covariance_are_its_own(points: np.ndarray) -> None:
    found = through(points, quadratic(points) + 7.0, -FAR, FAR)
    np.testing.assert_allclose(found.mean, MEAN, atol=1e-6)
    np.testing.assert_allclose(found.covariance, COVARIANCE, rtol=1e-3)
    normal = stats.norm(MEAN[1], np.sqrt(COVARIANCE[1, 1]))
    for share in (0.025, 0.5, 0.9):
        assert found.quantile(1, share) == pytest.approx(normal.ppf(share), abs=2e-3)
    assert found.density(1, -2.3) == pytest.approx(normal.pdf(-2.3) / normal.pdf(-2.0), rel=1e-3)


def test_bounds_cut_it_off(points: np.ndarray) -> None:
    """Above the mean of the first coordinate half of a normal is left, whose mean is σ √(2/π) above it."""
    found = through(points, quadratic(points), np.array([1.0, -50.0]), FAR)
    assert found.points[:, 0].min() > 1.0
    assert found.mean[0] == pytest.approx(1.0 + 0.2 * np.sqrt(2.0 / np.pi), rel=1e-3)


def test_without_a_summit_among_points_the_best_is_taken_for_it() -> None:
    """A log density that rises towards the last point at a bound."""
    points = np.linspace(0.0, 1.0, 6)[:, None]
    found = through(points, 4.0 * points[:, 0], np.zeros(1), np.ones(1))
    assert found.density(0, 1.0) == pytest.approx(1.0, abs=1e-3)
    assert 0.5 < found.mean[0] < 1.0
    assert found.density(0, 0.2) < found.density(0, 0.8)


def test_where_nothing_falls_all_within_bounds_are_as_probable() -> None:
    points = np.linspace(0.4, 0.6, 5)[:, None]
    found = through(points, np.zeros(5), np.zeros(1), np.ones(1))
    assert found.mean[0] == pytest.approx(0.5, abs=1e-3)
    assert np.sqrt(found.covariance[0, 0]) == pytest.approx(1.0 / np.sqrt(12.0), rel=1e-2)


def test_moments_and_quantiles_of_points_by_hand() -> None:
    given = BoundedGaussian(np.array([[0.0, 1.0], [2.0, 1.0], [2.0, 5.0]]), np.array([0.5, 0.25, 0.25]))
    np.testing.assert_allclose(given.mean, [1.0, 2.0])
    np.testing.assert_allclose(given.covariance, [[1.0, 1.0], [1.0, 3.0]])
    assert given.quantile(0, 0.5) == 1.0  # between the middles of both halves
    assert given.density(1, 5.0) == pytest.approx(1.0 / 3.0)
