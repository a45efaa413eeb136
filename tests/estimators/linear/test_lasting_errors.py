"""How errors of the stretches of a record go together, and what they do to slopes."""

import numpy as np
import pytest

from estimators.linear.lasting_errors import covariance_of_levels

COUNT = 20
ALIKE = np.ones(COUNT)
DESIGN = np.linalg.qr(np.stack([ALIKE, np.arange(COUNT)], axis=1))[0]
"""A level, and what grows evenly over the record."""


def correlations(lasting: float) -> np.ndarray:
    return np.exp(-np.abs(np.subtract.outer(np.arange(COUNT), np.arange(COUNT))) / lasting)


def variance_found(lasting: float, seeds: int = 300) -> float:
    """Of the slope of what grows evenly, over the true one (mean), where errors last for so many stretches."""
    truth = correlations(lasting)
    levels = np.linalg.cholesky(truth) @ np.random.default_rng(0).standard_normal((COUNT, seeds))
    found = np.mean([covariance_of_levels(level, DESIGN, ALIKE) for level in levels.T], axis=0)
    return float((DESIGN.T @ found @ DESIGN)[1, 1] / (DESIGN.T @ truth @ DESIGN)[1, 1])


@pytest.mark.parametrize(("lasting", "least", "most"), [(0.01, 1.0, 3.5), (3.0, 1.0, 3.0), (10.0, 0.7, 1.5)])
def test_the_variance_of_a_slope_is_the_true_one_or_larger(lasting: float, least: float, most: float) -> None:
    """Twenty stretches do not rule out that errors last. By sums over each of what is left it were 0.9, 0.15, 0.07."""
    assert least < variance_found(lasting) < most


def test_what_levels_may_follow_is_no_error() -> None:
    level = np.random.default_rng(0).standard_normal(COUNT)
    found = covariance_of_levels(level, DESIGN, ALIKE)
    np.testing.assert_allclose(covariance_of_levels(level + DESIGN @ [3.0, -20.0], DESIGN, ALIKE), found, rtol=1e-9)
    np.testing.assert_allclose(covariance_of_levels(10.0 * level, DESIGN, ALIKE), 100.0 * found, rtol=1e-9)


def test_a_stretch_of_few_samples_has_the_larger_errors_of_its_own() -> None:
    weight = np.where(np.arange(COUNT) == 7, 0.1, 1.0)
    level = np.random.default_rng(2).standard_normal(COUNT) / np.sqrt(weight)
    own = np.diag(covariance_of_levels(level, DESIGN, weight))
    assert own[7] > 3.0 * own[6] == pytest.approx(3.0 * own[8])


def test_levels_without_errors_have_none() -> None:
    assert np.abs(covariance_of_levels(np.zeros(COUNT), DESIGN, ALIKE)).max() < 1e-300
