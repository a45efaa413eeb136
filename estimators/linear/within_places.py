"""What samples say about the means of their places: freed of noise, and of errors that go together over time."""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy import special

from estimators.defaults import CLUSTERS, IDENTIFIABILITY, ROUNDING
from estimators.linear.least_squares import upper_triangle

if TYPE_CHECKING:
    from estimators.linear.slopes_of_places import Sums

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

SPARE = 3
"""Levels beyond what a fit of them takes up, from which the mean of their variance exists."""


def within_places(
    values: FloatArray, deviation: FloatArray, weight: FloatArray, time: FloatArray, noise: FloatArray, place: IntArray
) -> tuple[FloatArray, FloatArray]:
    """Triangular factors [3, 3] of the ``deviation`` [k, 3] of (v, f_n, μ) from the means of their places, as one
    without noise and of independent errors would be that says as much of slopes; and the same without another grasp.

    ``values`` [k, 3]: what deviates, at ``time`` [k] s in a ``place`` [k], codes from 0; ``noise`` [2]: roots of the
    sums of squares that noise in v and f_n adds.
    """
    from estimators.linear.slopes_of_places import seen_within, sums_of  # numba takes a while to load

    root = np.sqrt(weight)
    seen = seen_within(np.ascontiguousarray(values), deviation, root, CLUSTERS.alone, ROUNDING)
    seen.components[:, :2] = calibrated(seen.components[:, :2], noise)
    shares = (np.eye(len(seen.components)),) * 2
    if len(seen.components) and seen.size > 0.0:
        shares = _fewer(sums_of(seen.axes, seen.residual / seen.size, root, _stretches(time), place), len(root))
    left = np.append(np.zeros(2), np.linalg.norm(seen.residual))
    rows = (np.vstack([share @ seen.components, left]) for share in shares)
    beside, alone = (np.asarray(upper_triangle(each), dtype=float) for each in rows)
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


def _fewer(sums: "Sums", samples: int) -> tuple[FloatArray, FloatArray]:
    """Roots [d, d] of the share of so many samples that inform each slope as independent ones would: of a grasp of
    several, and of one alone.

    A slope along one of the axes is off by what it has of the errors; were those of k samples independent, with squares
    that sum to 1, by a variance of 1/k. Where they go together it is larger: so many times fewer samples inform the
    slope (Kish, 1965, ch. 8). Those of a place may last for longer than a stretch; what all places have in one comes on
    top. One place among several grasps shows that by its slopes (``slopes_of_grasps``).
    """
    from estimators.linear.slopes_of_places import information_left

    levels, (places, _, slopes) = int(np.count_nonzero(sums.weight)), sums.along.shape
    settings = CLUSTERS.by_chance, CLUSTERS.alone
    unit, enough = np.eye(slopes), levels >= places + slopes + SPARE
    if places == 1 or not enough:
        beside = information_left(unit, unit / samples, sums.scores, levels, *settings)
    if not enough:
        return beside, beside
    freedom = samples - places - slopes  # what is left of a fit is less than the errors are
    flat = sums.scores.reshape(-1, slopes)
    several, alone = (
        information_left(freedom * found, flat.T @ flat, sums.scores, levels, *settings) for found in variances(sums)
    )
    return several if places > 1 else beside, alone


def variances(sums: "Sums") -> tuple[FloatArray, FloatArray]:
    """Of the slopes of a grasp, [d, d], as one of several and where it is alone.

    Errors of its places last as their levels say. Places of which these say too little show by how much their slopes
    differ; against that, levels have the weight of ``lasting_freedom`` degrees of freedom. With as many beside those of
    the places, what lasts is allowed for by Student's t in place of the normal density.
    """
    from estimators.linear.few_columns import spanned
    from estimators.linear.lasting_errors import errors_of_levels
    from estimators.linear.slopes_of_places import compared, errors_of_slopes, levels_of

    level, means = levels_of(sums)
    design = spanned(means, CLUSTERS.alone).reshape(*level.shape, -1)
    own, lasting = errors_of_slopes(sums, level, *errors_of_levels(level, design, sums.weight, CLUSTERS.independent))
    freedom, differ = compared(sums, own + lasting, CLUSTERS.alone)
    own, lasting = own.sum(axis=0), lasting.sum(axis=0)
    if len(sums.weight) == 1:
        return own + lasting, own + lasting
    known, end = CLUSTERS.lasting_freedom + freedom, IDENTIFIABILITY.ends[1]
    wider = (special.stdtrit(known, end) / special.ndtri(end)) ** 2
    times = (CLUSTERS.lasting_freedom + freedom * differ) / known
    return own + lasting, max(times, 1.0) * (own + wider * lasting)


def _stretches(time: FloatArray) -> IntArray:
    """Codes [k] from 0 of stretches with about as many samples each; those of one moment are in one stretch."""
    ordered = np.sort(time)
    starts = ordered[np.arange(CLUSTERS.time_blocks) * len(time) // CLUSTERS.time_blocks]
    return np.searchsorted(np.unique(starts), time, side="right") - 1
