"""What samples say about the means of their places: freed of noise, and of errors that go together over time."""

import numpy as np
from numpy.typing import NDArray

from estimators.defaults import CLUSTERS, ROUNDING
from estimators.linear.lasting_errors import SPARE
from estimators.linear.least_squares import upper_triangle
from estimators.linear.slopes_of_places import Sums, power, spanned, sums_of, variances

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


def within_places(
    values: FloatArray, deviation: FloatArray, weight: FloatArray, time: FloatArray, noise: FloatArray, place: IntArray
) -> tuple[FloatArray, FloatArray]:
    """Triangular factors [3, 3] of the ``deviation`` [k, 3] of (v, f_n, μ) from the means of their places, as one
    without noise and of independent errors would be that says as much of slopes; and the same without another grasp.

    ``values`` [k, 3]: what deviates, at ``time`` [k] s in a ``place`` [k], codes from 0; ``noise`` [2]: roots of the
    sums of squares that noise in v and f_n adds.
    """
    root = np.sqrt(weight)[:, None]
    rows = root * deviation
    varies = np.linalg.norm(rows[:, :2], axis=0) > ROUNDING * np.linalg.norm(root * values[:, :2], axis=0)
    rows[:, :2] *= varies  # else the noise of a force that stays as it is would stand in the same direction as velocity
    axes = spanned(rows[:, :2])
    told = axes.T @ rows
    residual = rows[:, 2] - axes @ told[:, 2]
    left = np.append(np.zeros(2), np.linalg.norm(residual))
    told[:, :2] = calibrated(told[:, :2], noise)
    shares = (np.eye(len(told)),) * 2
    if axes.size and left[2] > ROUNDING * np.linalg.norm(root[:, 0] * values[:, 2]):
        shares = _fewer(sums_of(axes, residual / left[2], root[:, 0], _stretches(time), place), len(rows))
    beside, alone = (np.asarray(upper_triangle(np.vstack([share @ told, left])), dtype=float) for share in shares)
    return beside, alone


def calibrated(regressors: FloatArray, noise: FloatArray) -> FloatArray:
    """Rows [d, 2] of (v, f_n) replaced by what is expected of them without noise (regression calibration; Carroll et
    al., 2006, §4).

    Of measured X those expected are X(1 − (XᵀX)⁻¹N) = (1 − AAᵀ)X, with the noise's part N = D² of XᵀX, D = diag(noise),
    and A = (X⁺)ᵀD, whose squared singular values are the noise's shares in X: all of it at most.
    """
    size = np.linalg.norm(regressors, axis=0)
    if not (noise * size).any():
        return regressors
    size[size == 0.0] = np.inf  # what does not vary has no noise
    axes, parts, _ = np.linalg.svd(np.linalg.pinv(regressors / size).T * (noise / size), full_matrices=False)
    return np.asarray(regressors - (axes * np.minimum(parts, 1.0) ** 2) @ axes.T @ regressors)


def _fewer(sums: Sums, samples: int) -> tuple[FloatArray, FloatArray]:
    """Roots [d, d] of the share of so many samples that inform each slope as independent ones would: of a grasp of
    several, and of one alone.

    A slope along one of the axes is off by what it has of the errors; were those of k samples independent, with squares
    that sum to 1, by a variance of 1/k. Where they go together it is larger: so many times fewer samples inform the
    slope (Kish, 1965, ch. 8). Those of a place may last for longer than a stretch; what all places have in one comes on
    top. One place among several grasps shows that by its slopes (``slopes_of_grasps``).
    """
    places, slopes = len(sums.weight), sums.along.shape[2]
    unit = np.eye(slopes)
    if sums.levels < places + slopes + SPARE:
        return (_root_of_share(unit, unit / samples, sums.scores),) * 2
    freedom = samples - places - slopes  # what is left of a fit is less than the errors are
    found = (_beyond_chance(freedom * variance, sums.levels) for variance in variances(sums))
    own = _products(sums.scores)
    beside, alone = (_root_of_share(times, own, sums.scores) for times in found)
    return beside if places > 1 else _root_of_share(unit, unit / samples, sums.scores), alone


def _root_of_share(times: FloatArray, own: FloatArray, scores: FloatArray) -> FloatArray:
    """Of slopes whose variance errors of places make so many ``times`` larger, [d, d], and what all places have in a
    stretch as many times as the sums of ``scores`` [p, b, d] over them have the variance of their ``own`` [d, d] (Liang
    & Zeger, 1986).
    """
    count = scores.shape[1]
    half, unit = power(times, 0.5), power(own, -0.5)
    shared = unit @ _products(scores.sum(axis=0)) @ unit * count / max(count - 1, 1)
    parts, directions = np.linalg.eigh(half @ _beyond_chance(shared, count) @ half)
    return np.asarray((directions / np.sqrt(np.maximum(parts, 1.0))) @ directions.T)


def _products(sums: FloatArray) -> FloatArray:
    """Sum of the products [d, d] of ``sums`` [..., d]."""
    rows = sums.reshape(-1, sums.shape[-1])
    return np.asarray(rows.T @ rows)


def _beyond_chance(times: FloatArray, count: int) -> FloatArray:
    """The same matrix [d, d], 1 along what so many independent errors may have by chance."""
    parts, directions = np.linalg.eigh(times)
    parts = np.where(parts > 1.0 + CLUSTERS.by_chance * np.sqrt(2.0 / count), parts, 1.0)
    return np.asarray((directions * parts) @ directions.T)


def _stretches(time: FloatArray) -> IntArray:
    """Codes [k] from 0 of stretches with about as many samples each; those of one moment are in one stretch."""
    ordered = np.sort(time)
    starts = ordered[np.arange(CLUSTERS.time_blocks) * len(time) // CLUSTERS.time_blocks]
    return np.searchsorted(np.unique(starts), time, side="right") - 1
