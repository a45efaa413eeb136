"""What samples say about the means of their places: freed of noise, and of errors that go together over time."""

import numpy as np
from numpy.typing import NDArray

from estimators.defaults import CLUSTERS, ROUNDING
from estimators.linear.lasting_errors import SPARE, covariance_of_levels
from estimators.linear.least_squares import upper_triangle

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


def within_places(
    values: FloatArray,
    deviation: FloatArray,
    weight: FloatArray,
    time: FloatArray,
    noise: FloatArray,
    *,
    alone: bool = False,
) -> FloatArray:
    """Triangular factor [3, 3] of the ``deviation`` [k, 3] of (v, f_n, μ) from the means of their places, as one
    without noise and of independent errors would be that says as much of slopes.

    ``values`` [k, 3]: what deviates, at ``time`` [k] s; ``noise`` [2]: roots of the sums of squares that noise in v and
    f_n adds; ``alone``: all are of one place.
    """
    root = np.sqrt(weight)[:, None]
    rows = root * deviation
    varies = np.linalg.norm(rows[:, :2], axis=0) > ROUNDING * np.linalg.norm(root * values[:, :2], axis=0)
    rows[:, :2] *= varies  # else the noise of a force that stays as it is would stand in the same direction as velocity
    axes = _axes(rows[:, :2])
    told = axes.T @ rows
    residual = rows[:, 2] - axes @ told[:, 2]
    left = np.append(np.zeros(2), np.linalg.norm(residual))
    told[:, :2] = calibrated(told[:, :2], noise)
    if axes.size and left[2] > ROUNDING * np.linalg.norm(root[:, 0] * values[:, 2]):
        told = _fewer(axes, residual / left[2], root[:, 0], _stretches(time), alone) @ told
    return np.asarray(upper_triangle(np.vstack([told, left])), dtype=float)


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


def _axes(rows: FloatArray) -> FloatArray:
    """Orthonormal columns [k, ≤ c] that span those of ``rows`` [k, c] which are not 0."""
    size = np.linalg.norm(rows, axis=0)
    varies = size > 0.0
    axes, parts, _ = np.linalg.svd(rows[:, varies] / size[varies], full_matrices=False)
    return np.asarray(axes[:, parts > CLUSTERS.alone])


def _fewer(axes: FloatArray, residual: FloatArray, root: FloatArray, stretch: IntArray, alone: bool) -> FloatArray:
    """Root [d, d] of the share of the samples that inform each slope as independent ones would.

    A slope along one of the ``axes`` [k, d] is off by what it has of the errors; were the k of them independent, with
    squares that sum to 1 as those of the ``residual`` [k], by a variance of 1/k. Where they go together it is larger:
    so many times fewer samples inform the slope (Kish, 1965, ch. 8). What chance makes of independent ones is none.
    ``root`` [k]: of the weights, that both are times; ``stretch`` [k] of time, codes from 0.
    """
    count, (size, slopes) = int(stretch.max()) + 1, axes.shape
    if alone and count >= 1 + slopes + SPARE:
        variance = _of_lasting_errors(axes, residual, root, stretch)
    else:
        variance = _of_sums(axes * residual[:, None], stretch)
    times, directions = np.linalg.eigh(variance * size)
    times = np.where(times > 1.0 + CLUSTERS.by_chance * np.sqrt(2.0 / count), times, 1.0)
    return np.asarray((directions / np.sqrt(times)) @ directions.T)


def _of_sums(scores: FloatArray, stretch: IntArray) -> FloatArray:
    """Variance [d, d] of slopes whose errors are the sums of ``scores`` [k, d], by those over stretches of time, which
    all places share (Liang & Zeger, 1986).
    """
    sums = np.stack([np.bincount(stretch, column) for column in scores.T])
    count = sums.shape[1]
    return np.asarray(sums @ sums.T * count / max(count - 1, 1))


def _of_lasting_errors(axes: FloatArray, residual: FloatArray, root: FloatArray, stretch: IntArray) -> FloatArray:
    """Variance [d, d] of the slopes of one place, whose errors may last for longer than a stretch: by the covariance of
    the levels of stretches, and by sums over each about its level.
    """
    weight = np.bincount(stretch, root**2).astype(float)
    level = np.bincount(stretch, root * residual) / weight
    along = np.stack([np.bincount(stretch, root * column) for column in axes.T], axis=1)
    design = _axes(np.column_stack([np.ones(len(level)), along / weight[:, None]]))
    between = along.T @ covariance_of_levels(level, design, weight) @ along
    return np.asarray(between + _of_sums(axes * (residual - root * level[stretch])[:, None], stretch))


def _stretches(time: FloatArray) -> IntArray:
    """Codes [k] from 0 of stretches with about as many samples each; those of one moment are in one stretch."""
    ordered = np.sort(time)
    starts = ordered[np.arange(CLUSTERS.time_blocks) * len(time) // CLUSTERS.time_blocks]
    return np.searchsorted(np.unique(starts), time, side="right") - 1
