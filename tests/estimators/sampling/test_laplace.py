"""Laplace's approximation on densities whose mode and curvature are known."""

import numpy as np
import pytest

from estimators.sampling.laplace import laplace


@pytest.mark.parametrize("size", [1, 2, 6])
def test_a_normal_density_is_found_exactly(size: int) -> None:
    rng = np.random.default_rng(size)
    root = np.eye(size) + 0.3 * rng.standard_normal((size, size))
    centre = 3.0 * rng.standard_normal(size)
    precision = np.linalg.inv(root @ root.T)
    mode, found = laplace(lambda x: -0.5 * np.einsum("ki,ij,kj->k", x - centre, precision, x - centre), np.zeros(size))
    np.testing.assert_allclose(mode, centre, atol=1e-6)  # differences of sums of order 10, over 0.1²
    np.testing.assert_allclose(found @ found.T, root @ root.T, rtol=1e-5, atol=1e-5)


def test_a_skewed_density_gives_its_mode_and_curvature() -> None:
    """log of a gamma variable of shape 5: mode log 5, curvature 5."""
    mode, root = laplace(lambda x: (5.0 * x - np.exp(x))[:, 0], np.array([-2.0]))
    np.testing.assert_allclose(mode, np.log(5.0), atol=0.05 / np.sqrt(5.0))  # it stops within a few hundredths of sd
    np.testing.assert_allclose(root**2, 0.2, rtol=0.02)


def test_a_start_far_away_and_of_the_wrong_size_still_arrives() -> None:
    centre, spread = np.array([40.0, -0.3]), np.array([5.0, 1e-3])
    mode, root = laplace(lambda x: -0.5 * (((x - centre) / spread) ** 2).sum(axis=1), np.zeros(2))
    np.testing.assert_allclose((mode - centre) / spread, 0.0, atol=0.05)
    np.testing.assert_allclose(np.diag(root @ root.T), spread**2, rtol=1e-3)


def test_points_outside_the_support_are_avoided() -> None:
    def log_density(x: np.ndarray) -> np.ndarray:
        return np.where(x[:, 0] > 0.0, 2.0 * np.log(np.maximum(x[:, 0], 1e-300)) - x[:, 0], -np.inf)

    mode, root = laplace(log_density, np.array([0.5]))
    np.testing.assert_allclose(mode, 2.0, atol=0.05)
    np.testing.assert_allclose(root**2, 2.0, rtol=0.05)
