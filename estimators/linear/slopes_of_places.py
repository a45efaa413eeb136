"""By how much the slopes of a grasp are off where errors of its places last: by their levels, and by their slopes."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import special

from estimators.defaults import CLUSTERS, IDENTIFIABILITY
from estimators.linear.lasting_errors import errors_of_levels

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


class Sums(NamedTuple):
    """Over the samples of each of p places in each of b stretches of time: their ``weight`` [p, b], the ``error``
    [p, b] that is left times it, the d orthonormal axes times it, ``along`` [p, b, d], and ``scores`` [p, b, d], the
    products of both; ``shares`` [p, d, d]: products of the axes over a place, which are 1 over all.
    """

    weight: FloatArray
    error: FloatArray
    along: FloatArray
    scores: FloatArray
    shares: FloatArray

    @property
    def levels(self) -> int:
        """Number of stretches in which places were seen."""
        return int(np.count_nonzero(self.weight))


def sums_of(axes: FloatArray, residual: FloatArray, root: FloatArray, time: IntArray, place: IntArray) -> Sums:
    """Sums over the samples [k] of a grasp, of weight ``root``², each in a stretch of ``time`` and a ``place``.

    Both are codes from 0; the axes [k, d] and the ``residual`` [k] are times the root of the weight.
    """
    places, stretches, slopes = int(place.max()) + 1, int(time.max()) + 1, axes.shape[1]
    products = [axes[:, i] * axes[:, j] for i in range(slopes) for j in range(slopes)]
    columns = [root * root, root * residual, *(root * axis for axis in axes.T), *(residual * axis for axis in axes.T)]
    cell = place * stretches + time
    added = np.stack([np.bincount(cell, column, places * stretches) for column in columns], axis=1)
    sums: FloatArray = added.reshape(places, stretches, -1).astype(float)
    shares = np.stack([np.bincount(place, column, places) for column in products], axis=1).astype(float)
    ends = 2 + slopes
    return Sums(sums[..., 0], sums[..., 1], sums[..., 2:ends], sums[..., ends:], shares.reshape(-1, slopes, slopes))


def variances(sums: Sums) -> tuple[FloatArray, FloatArray]:
    """Of the slopes of a grasp, [d, d], as one of several and where it is alone.

    Errors of its places last as their levels say. Places of which these say too little show by how much their slopes
    differ (analysis of covariance); against that, levels have the weight of ``lasting_freedom`` degrees of freedom.
    With as many beside those of the places, what lasts is allowed for by Student's t in place of the normal density.
    """
    own, lasting = _by_levels(sums)
    whole, places = (own + lasting).sum(axis=0), len(lasting)
    if places == 1:
        return whole, whole
    part = (power(whole, -1.0) * (own + lasting)).sum(axis=(1, 2)) / len(whole)
    freedom = len(whole) * (1.0 / np.square(part).sum() - 1.0)
    known, level = CLUSTERS.lasting_freedom + freedom, IDENTIFIABILITY.ends[1]
    wider = (special.stdtrit(known, level) / special.ndtri(level)) ** 2
    times = (CLUSTERS.lasting_freedom + freedom * _others(sums, own + lasting)) / known
    return whole, max(times, 1.0) * (own + wider * lasting).sum(axis=0)


def _by_levels(sums: Sums) -> tuple[FloatArray, FloatArray]:
    """Variance of what each place adds to the slopes, [p, d, d]: of what is each stretch's own, and of what lasts."""
    seen = sums.weight > 0.0
    known = np.where(seen, sums.weight, 1.0)
    level, means = sums.error / known, sums.along / known[..., None]
    means = means - seen[..., None] * (means.sum(axis=1) / seen.sum(axis=1)[:, None])[:, None]
    design = spanned(means.reshape(-1, means.shape[2])).reshape(*level.shape, -1)
    errors = errors_of_levels(level, design, sums.weight)
    about, turned = sums.scores - level[..., None] * sums.along, sums.along.swapaxes(1, 2)
    own = turned * errors.own[:, None] @ sums.along + about.swapaxes(1, 2) @ about
    return own, turned @ errors.lasting @ sums.along


def _others(sums: Sums, variance: FloatArray) -> float:
    """Mean square of what places' slopes differ by, over that of errors of ``variance`` [p, d, d]."""
    off, whole = sums.scores.sum(axis=1), variance.sum(axis=0)
    taken = sums.shares @ variance
    expected = (variance - taken - taken.swapaxes(1, 2) + sums.shares @ whole @ sums.shares).sum(axis=0)
    unit = power(whole, -1.0)
    return float((unit * (off.T @ off)).sum() / max((unit * expected).sum(), np.finfo(float).tiny))


def spanned(rows: FloatArray) -> FloatArray:
    """Orthonormal columns [k, ≤ c] that span those of ``rows`` [k, c] which are not 0."""
    size = np.linalg.norm(rows, axis=0)
    varies = size > 0.0
    axes, parts, _ = np.linalg.svd(rows[:, varies] / size[varies], full_matrices=False)
    return np.asarray(axes[:, parts > CLUSTERS.alone])


def power(square: FloatArray, exponent: float) -> FloatArray:
    """Of a symmetric matrix [d, d] without negative parts, of which those of 0 stay 0."""
    parts, directions = np.linalg.eigh(square)
    known = parts > CLUSTERS.alone * parts[-1]
    return np.asarray((directions * np.where(known, np.where(known, parts, 1.0) ** exponent, 0.0)) @ directions.T)
