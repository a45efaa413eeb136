"""CR2 standard errors: unbiased under independent errors, degrees of freedom in closed form, bounds of few clusters."""

import numpy as np
import pytest

from estimators.linear.cluster_errors import (
    _inverse_root,
    _raise_all,
    _raise_dominated,
    cluster_robust,
    cluster_sums,
    satterthwaite,
)


@pytest.fixture
def design() -> tuple[np.ndarray, np.ndarray]:
    """Orthonormal columns [120, 2] of clusters [120] that differ in size and in what they determine."""
    rng = np.random.default_rng(5)
    cluster = np.repeat(np.arange(12), rng.integers(6, 15, 12))[:120]
    columns = np.column_stack([np.ones(len(cluster)), rng.standard_normal(len(cluster)) + 0.3 * cluster])
    return np.linalg.qr(columns)[0], cluster


def test_variance_is_unbiased_where_errors_are_independent(design: tuple[np.ndarray, np.ndarray]) -> None:
    """The mean over independent errors of variance 1 is the sum over errors of 1 at one sample each."""
    q, cluster = design
    residuals = np.eye(len(q)) - q @ q.T
    mean = np.zeros((2, 2))
    for residual in residuals:
        mean += cluster_robust(*cluster_sums([(q, residual, cluster)], 12), scale=0.0)
    np.testing.assert_allclose(mean, np.eye(2), rtol=0, atol=1e-12)
    assert _inverse_root(np.array([0.75])) == pytest.approx(2.0)  # (1 − 3/4)^{-1/2}
    assert _inverse_root(np.array([1.0])) == 0.0  # what one cluster alone determines


def test_many_clusters_have_the_sandwich_as_it_is() -> None:
    """Of 40 pairs that err alike by ± 1: each tells (1 + 1)²/80 of it, over 1 − 1/40."""
    error = np.where(np.arange(40) % 2, 1.0, -1.0)
    q, cluster = np.full((80, 1), 1.0 / np.sqrt(80.0)), np.repeat(np.arange(40), 2)
    sums = cluster_sums([(q, error[cluster], cluster)], 40)
    expected = 40.0 * (2.0 / np.sqrt(80.0)) ** 2 / (1.0 - 1.0 / 40.0)
    assert cluster_robust(*sums, scale=1e-9)[0, 0] == pytest.approx(expected, rel=1e-12)
    assert cluster_robust(*sums, scale=30.0)[0, 0] == pytest.approx(expected, rel=1e-12)


def test_few_clusters_are_never_surer_than_independent_samples() -> None:
    """Of two that err by nothing the classical variance is left, and of three nothing."""
    for count, expected in ((2, 0.09), (3, 0.0)):
        q, cluster = np.full((2 * count, 1), np.sqrt(0.5 / count)), np.repeat(np.arange(count), 2)
        sums = cluster_sums([(q, np.zeros(2 * count), cluster)], count)
        assert cluster_robust(*sums, scale=0.3)[0, 0] == pytest.approx(expected, rel=1e-12)


def test_sums_over_blocks_are_those_of_all_samples(design: tuple[np.ndarray, np.ndarray]) -> None:
    q, cluster = design
    error = np.random.default_rng(6).standard_normal(len(q))
    whole = cluster_sums([(q, error, cluster)], 12)
    parts = cluster_sums([(q[:50], error[:50], cluster[:50]), (q[50:], error[50:], cluster[50:])], 12)
    for one, other in zip(whole, parts, strict=True):
        np.testing.assert_allclose(one, other, rtol=0, atol=1e-14)
    np.testing.assert_allclose(whole[0].sum(axis=0), np.eye(2), rtol=0, atol=1e-12)
    inside = cluster == 4
    np.testing.assert_allclose(whole[0][4], q[inside].T @ q[inside], rtol=0, atol=1e-14)
    np.testing.assert_allclose(whole[1][4], q[inside].T @ error[inside], rtol=0, atol=1e-14)


@pytest.mark.parametrize("count", [2, 5, 30])
def test_a_mean_over_equal_clusters_has_one_degree_of_freedom_less_than_clusters(count: int) -> None:
    q, cluster = np.full((4 * count, 1), 0.5 / np.sqrt(count)), np.repeat(np.arange(count), 4)
    square, _ = cluster_sums([(q, np.zeros(len(q)), cluster)], count)
    assert satterthwaite(square, np.array([[1.0], [-3.0]])) == pytest.approx([count - 1.0] * 2, rel=1e-9)


def test_a_variance_is_raised_along_directions_below_a_floor() -> None:
    turn = np.array([[0.6, 0.8], [-0.8, 0.6]])
    raised = _raise_all(turn.T @ np.diag([4.0, 0.5]) @ turn, 1.5)
    np.testing.assert_allclose(turn @ raised @ turn.T, np.diag([4.0, 1.5]), rtol=0, atol=1e-12)


def test_a_direction_that_one_cluster_dominates_is_raised_and_others_are_not() -> None:
    share, directions = np.array([0.95, 0.2]), np.eye(2)
    np.testing.assert_allclose(_raise_dominated(np.diag([1.0, 1.0]), share, directions, 3.0), np.diag([3.0, 1.0]))
    np.testing.assert_allclose(_raise_dominated(np.diag([4.0, 1.0]), share, directions, 3.0), np.diag([4.0, 1.0]))
