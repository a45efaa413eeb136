"""By how much the slopes of a grasp are off where errors of its places last: by their levels, and by their slopes.

Compiled: it takes numba a while to load.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from estimators.linear.few_columns import TINY, from_one, power, spanned, times
from slipcore.compilation import compiled

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


class WithinPlaces(NamedTuple):
    """What samples [k] say within places: orthonormal ``axes`` [k, d] of what of v and f_n varies, what (v, f_n, μ) are
    along them, ``components`` [d, 3]; the ``residual`` [k], and its ``size``, 0 where it is rounding.
    """

    axes: FloatArray
    components: FloatArray
    residual: FloatArray
    size: float


@compiled
def seen_within(
    values: FloatArray, deviation: FloatArray, root: FloatArray, alone: float, rounding: float
) -> WithinPlaces:
    """Of samples whose (v, f_n, μ) are ``values`` [k, 3], with a ``deviation`` [k, 3] from the means of their places
    and the ``root`` [k] of their weight. What varies by ``rounding`` alone, or not but with the other, stays out.
    """
    samples, size, varied = len(values), np.zeros(3), np.zeros(3)
    for k in range(samples):
        for column in range(3):
            size[column] += (root[k] * values[k, column]) ** 2
            varied[column] += (root[k] * deviation[k, column]) ** 2
    rows, residual, left = np.zeros((samples, 2)), np.empty(samples), 0.0
    for k in range(samples):
        residual[k] = root[k] * deviation[k, 2]
        for column in range(2):  # else noise of a force that stays as it is would stand in velocity's direction
            if math.sqrt(varied[column]) > rounding * math.sqrt(size[column]):
                rows[k, column] = root[k] * deviation[k, column]
    axes = spanned(rows, alone)
    components = np.zeros((axes.shape[1], 3))
    for i in range(axes.shape[1]):
        for k in range(samples):
            components[i, 0] += axes[k, i] * rows[k, 0]
            components[i, 1] += axes[k, i] * rows[k, 1]
            components[i, 2] += axes[k, i] * root[k] * deviation[k, 2]
        for k in range(samples):
            residual[k] -= axes[k, i] * components[i, 2]
    for k in range(samples):
        left += residual[k] * residual[k]
    return WithinPlaces(
        axes, components, residual, math.sqrt(left) if math.sqrt(left) > rounding * math.sqrt(size[2]) else 0.0
    )


@compiled
def sums_of(axes: FloatArray, residual: FloatArray, root: FloatArray, time: IntArray, place: IntArray) -> Sums:
    """Sums over the samples [k] of a grasp, of weight ``root``², each in a stretch of ``time`` and a ``place``.

    Both are codes from 0; the axes [k, d] and the ``residual`` [k] are times the root of the weight.
    """
    places, stretches, slopes = place.max() + 1, time.max() + 1, axes.shape[1]
    weight, error = np.zeros((places, stretches)), np.zeros((places, stretches))
    along, scores = np.zeros((places, stretches, slopes)), np.zeros((places, stretches, slopes))
    shares = np.zeros((places, slopes, slopes))
    for k in range(len(place)):
        at, when = place[k], time[k]
        weight[at, when] += root[k] * root[k]
        error[at, when] += root[k] * residual[k]
        for i in range(slopes):
            along[at, when, i] += root[k] * axes[k, i]
            scores[at, when, i] += residual[k] * axes[k, i]
            for j in range(slopes):
                shares[at, i, j] += axes[k, i] * axes[k, j]
    return Sums(weight, error, along, scores, shares)


@compiled
def levels_of(sums: Sums) -> tuple[FloatArray, FloatArray]:
    """The level [p, b] of the errors of each place in each stretch, and the means [p · b, d] of the axes about those of
    their place.
    """
    places, stretches, slopes = sums.along.shape
    level, means = np.zeros((places, stretches)), np.zeros((places * stretches, slopes))
    for place in range(places):
        seen, total = 0, np.zeros(slopes)
        for stretch in range(stretches):
            if sums.weight[place, stretch] > 0.0:
                seen += 1
                level[place, stretch] = sums.error[place, stretch] / sums.weight[place, stretch]
                for i in range(slopes):
                    mean = sums.along[place, stretch, i] / sums.weight[place, stretch]
                    means[place * stretches + stretch, i] = mean
                    total[i] += mean
        for stretch in range(stretches):
            if sums.weight[place, stretch] > 0.0:
                for i in range(slopes):
                    means[place * stretches + stretch, i] -= total[i] / seen
    return level, means


@compiled
def errors_of_slopes(
    sums: Sums, level: FloatArray, own_error: FloatArray, lasting_error: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Variance of what each place adds to the slopes, [p, d, d]: of what is each stretch's own, and of what lasts.

    ``level``: as by ``levels_of``; the errors of the levels: as ``LevelErrors``.
    """
    places, stretches, slopes = sums.along.shape
    own, lasting = np.zeros((places, slopes, slopes)), np.zeros((places, slopes, slopes))
    about = np.empty(slopes)
    for place in range(places):
        along = sums.along[place]
        for stretch in range(stretches):
            for i in range(slopes):
                about[i] = sums.scores[place, stretch, i] - level[place, stretch] * along[stretch, i]
                gone_with = 0.0
                for other in range(stretches):
                    gone_with += lasting_error[stretch, other] * along[other, i]
                for j in range(slopes):
                    lasting[place, i, j] += gone_with * along[stretch, j]
            for i in range(slopes):
                for j in range(slopes):
                    own[place, i, j] += own_error[place, stretch] * along[stretch, i] * along[stretch, j]
                    own[place, i, j] += about[i] * about[j]
    return own, lasting


@compiled
def compared(sums: Sums, variance: FloatArray, alone: float) -> tuple[float, float]:
    """Degrees of freedom with which places show by their slopes how errors of ``variance`` [p, d, d] last, and the mean
    square of what these slopes differ by, over that which such errors would have (analysis of covariance).
    """
    places, slopes = variance.shape[:2]
    whole = variance.sum(axis=0)
    unit = power(whole, -1.0, alone)
    off, square, expected, parts = np.zeros(slopes), 0.0, 0.0, 0.0
    for place in range(places):
        share, own = sums.shares[place], variance[place]
        taken, given, part = times(share, own), times(times(share, whole), share), 0.0
        for i in range(slopes):
            off[i] = sums.scores[place, :, i].sum()
            for j in range(slopes):
                part += unit[i, j] * own[i, j] / slopes
                expected += unit[i, j] * (own[i, j] - taken[i, j] - taken[j, i] + given[i, j])
        for i in range(slopes):
            for j in range(slopes):
                square += unit[i, j] * off[i] * off[j]
        parts += part * part
    return slopes * (1.0 / parts - 1.0), square / max(expected, TINY)


@compiled
def information_left(
    larger: FloatArray, own: FloatArray, scores: FloatArray, count: int, by_chance: float, alone: float
) -> FloatArray:
    """Root [d, d] of the share of the information on slopes that is left where errors of places, seen in so many
    (``count``) levels, make their variance so many times ``larger``, [d, d].

    What all places have in a stretch comes on top: as many times as the sums of ``scores`` [p, b, d] over them have the
    variance of their ``own`` [d, d] (Liang & Zeger, 1986). Along what so many independent errors may have by chance
    neither is larger.
    """
    stretches, slopes = scores.shape[1:]
    together = np.zeros((slopes, slopes))
    for stretch in range(stretches):
        for i in range(slopes):
            for j in range(slopes):
                together[i, j] += scores[:, stretch, i].sum() * scores[:, stretch, j].sum()
    together *= stretches / max(stretches - 1, 1)
    half = power(from_one(larger, 1.0 + by_chance * math.sqrt(2.0 / count), 1.0), 0.5, alone)
    unit = power(own, -0.5, alone)
    shared = from_one(times(times(unit, together), unit), 1.0 + by_chance * math.sqrt(2.0 / stretches), 1.0)
    return from_one(times(times(half, shared), half), 1.0, -0.5)
