"""How errors of the stretches of a record go together, and what they do to slopes."""

import numpy as np
import pytest

from estimators.defaults import CLUSTERS
from estimators.linear.lasting_errors import KEPT, LASTS, OWN, _left, errors_of_levels

COUNT = 20
ALIKE = np.ones(COUNT)
EVEN = np.arange(COUNT)[:, None]
DESIGN = np.linalg.qr(np.column_stack([ALIKE, EVEN]))[0]
"""A level, and what grows evenly over the record."""


def covariance_of_levels(level: np.ndarray, weight: np.ndarray = ALIKE) -> np.ndarray:
    """Of one place. Levels lie as in a fit: of others the kernel would be compiled anew, in four seconds."""
    level = np.ascontiguousarray(level)
    own, lasting = errors_of_levels(level[None], EVEN[None] / 1.0, weight[None], CLUSTERS.independent)
    return np.diag(own[0]) + lasting


def correlations(lasting: float) -> np.ndarray:
    return np.exp(-np.abs(np.subtract.outer(np.arange(COUNT), np.arange(COUNT))) / lasting)


def variance_found(lasting: float, seeds: int = 300) -> float:
    """Of the slope of what grows evenly, over the true one (mean), where errors last for so many stretches."""
    truth = correlations(lasting)
    levels = np.linalg.cholesky(truth) @ np.random.default_rng(0).standard_normal((COUNT, seeds))
    found = np.mean([covariance_of_levels(level) for level in levels.T], axis=0)
    return float((DESIGN.T @ found @ DESIGN)[1, 1] / (DESIGN.T @ truth @ DESIGN)[1, 1])


@pytest.mark.parametrize(("lasting", "least", "most"), [(0.01, 1.0, 3.5), (3.0, 1.0, 3.0), (10.0, 0.7, 1.5)])
def test_the_variance_of_a_slope_is_the_true_one_or_larger(lasting: float, least: float, most: float) -> None:
    """Twenty stretches do not rule out that errors last. By sums over each of what is left it were 0.9, 0.15, 0.07."""
    assert least < variance_found(lasting) < most


def test_what_levels_may_follow_is_no_error() -> None:
    level = np.random.default_rng(0).standard_normal(COUNT)
    found = covariance_of_levels(level)
    np.testing.assert_allclose(covariance_of_levels(level + DESIGN @ [3.0, -20.0]), found, rtol=1e-9)
    np.testing.assert_allclose(covariance_of_levels(10.0 * level), 100.0 * found, rtol=1e-9)


def test_a_stretch_of_few_samples_has_the_larger_errors_of_its_own() -> None:
    weight = np.where(np.arange(COUNT) == 7, 0.1, 1.0)
    level = np.random.default_rng(2).standard_normal(COUNT) / np.sqrt(weight)
    own = np.diag(covariance_of_levels(level, weight))
    assert own[7] > 3.0 * own[6] == pytest.approx(3.0 * own[8])


def test_levels_without_errors_have_none() -> None:
    assert np.abs(covariance_of_levels(np.zeros(COUNT))).max() < 1e-300


@pytest.mark.parametrize("hidden", [[], [3, 4, 5], [0, 7, 19]], ids=["all seen", "a gap", "ends"])
def test_what_is_left_is_by_the_whole_covariance_matrix(hidden: list[int]) -> None:
    """Of three places of which one was not seen throughout, by triangles of each covariance; as plain Python."""
    rng = np.random.default_rng(1)
    weight = rng.uniform(0.5, 2.0, (3, COUNT))
    weight[1, hidden] = 0.0
    own = np.divide(weight[weight > 0.0].mean(), weight, out=np.zeros_like(weight), where=weight > 0.0)
    rows = rng.standard_normal((3, COUNT, 3))
    rows[..., 0] = 1.0
    kept, share = KEPT.copy(), OWN.copy()
    kept.flags.writeable = share.flags.writeable = False  # as constants of a kernel are
    square, size = _left.py_func(rows[..., 2], rows[..., 1:2], own, kept, share)
    seen = (weight > 0.0).ravel()
    for k, (lasts, share) in enumerate(zip(LASTS, OWN, strict=True)):
        covariance = np.kron(np.eye(3), (1.0 - share) * correlations(lasts)) + share * np.diag(own.ravel())
        root = np.linalg.cholesky(covariance[np.ix_(seen, seen)])
        design = np.column_stack([np.kron(np.eye(3), np.ones((COUNT, 1))), rows[..., 1].ravel()])[seen]
        white = np.linalg.solve(root, np.column_stack([design, rows[..., 2].ravel()[seen]]))
        parts = np.diagonal(np.linalg.qr(white, mode="r"))
        assert square[k] == pytest.approx(parts[-1] ** 2, rel=1e-9)
        expected = np.log(np.diagonal(root)).sum() + np.log(np.abs(parts[:-1])).sum()
        assert size[k] == pytest.approx(expected, rel=1e-9, abs=1e-9)
