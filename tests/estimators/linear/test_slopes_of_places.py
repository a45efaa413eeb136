"""Variance of the slopes of a grasp whose places have lasting errors of their own."""

import numpy as np
import pytest
from scipy import special

from estimators.defaults import CLUSTERS
from estimators.linear.few_columns import spanned
from estimators.linear.slopes_of_places import Sums, sums_of
from estimators.linear.within_places import variances

SAMPLES, STRETCHES = 200, 20
TIME = np.arange(SAMPLES) * STRETCHES // SAMPLES


def lasting_for(samples: float) -> np.ndarray:
    """Correlation [k, k] of one place's errors."""
    apart = np.abs(np.subtract.outer(np.arange(SAMPLES), np.arange(SAMPLES)))
    return np.exp(-apart / samples) if samples else np.eye(SAMPLES)


def made(places: int, covariance: np.ndarray, seed: int) -> tuple[Sums, np.ndarray]:
    """Sums of a grasp in whose places two regressors wander, and the true covariance of its slopes, [2, 2]."""
    rng = np.random.default_rng([seed, places])
    root = np.linalg.cholesky(covariance)
    wander = np.linalg.cholesky(lasting_for(60.0)) @ rng.standard_normal((2, places, SAMPLES, 1))
    rows = np.stack([wander[0, ..., 0], wander[1, ..., 0] + wander[0, ..., 0]], axis=-1)
    axes = spanned((rows - rows.mean(axis=1, keepdims=True)).reshape(-1, 2), CLUSTERS.alone)
    errors = (root @ rng.standard_normal((places, SAMPLES, 1)))[..., 0]
    errors = (errors - errors.mean(axis=1, keepdims=True)).ravel()
    residual = errors - axes @ (axes.T @ errors)
    place = np.repeat(np.arange(places), SAMPLES)
    sums = sums_of(axes, residual, np.ones(places * SAMPLES), np.tile(TIME, places), place)
    each = axes.reshape(places, SAMPLES, 2)
    return sums, np.einsum("pki,kl,plj->ij", each, covariance, each)


@pytest.mark.parametrize("places", [2, 5, 10])
@pytest.mark.parametrize("samples", [0.0, 10.0, 100.0], ids=["independent", "a stretch", "half"])
def test_the_variance_of_slopes_is_the_true_one(places: int, samples: float) -> None:
    """In the middle of 30 grasps. By sums over stretches it is a seventh where errors last for half of the record."""
    found = []
    for seed in range(30):
        sums, truth = made(places, lasting_for(samples), seed)
        found.append(np.trace(variances(sums)[0]) / np.trace(truth))
    assert 0.65 < np.median(found) < 1.45


def test_few_places_alone_have_wider_intervals_for_what_lasts_and_for_nothing_else() -> None:
    independent, half = np.eye(SAMPLES), lasting_for(100.0)
    for places in (2, 3, 10):
        freedom = CLUSTERS.lasting_freedom + 2.0 * (places - 1)
        wider = (special.stdtrit(freedom, 0.975) / special.ndtri(0.975)) ** 2
        ratios = []
        for covariance in (independent, half):
            found = [variances(made(places, covariance, seed)[0]) for seed in range(30)]
            ratios.append(np.median([np.trace(alone) / np.trace(several) for several, alone in found]))
        assert ratios[0] < 1.35
        assert 0.9 * wider < ratios[1] < 1.2 * wider


def test_places_show_by_their_slopes_that_errors_are_others_than_their_levels_say() -> None:
    """Ten that each follow a parabola of time: levels so smooth say less than their slopes differ by."""
    time = np.linspace(-1.0, 1.0, SAMPLES)
    covariance = np.exp(-0.5 * np.subtract.outer(time, time) ** 2 / 0.8**2) + 1e-6 * np.eye(SAMPLES)
    ratios = []
    for seed in range(30):
        sums, truth = made(10, covariance, seed)
        ratios.append([np.trace(found) / np.trace(truth) for found in variances(sums)])
    several, alone = np.median(ratios, axis=0)
    assert several < 0.6
    assert 0.7 < alone < 1.6


def test_one_place_shows_nothing_but_its_levels() -> None:
    several, alone = variances(made(1, lasting_for(100.0), 0)[0])
    np.testing.assert_array_equal(several, alone)
