"""How far the object moves over an element before it slips: in proportion to how deep it was pressed in.

An element of a contact sticks until the object has moved over it by c times the depth that it was pressed in since it
touched, c = μ E*/G* for friction μ and the moduli of normal and tangential load (Jäger, J. Tribol. 120 (1998) 677). So
each is a spring that slides at c times its own compression (Popov and Heß, Method of Dimensionality Reduction, 2015),
and what loads do that turn back or change follows. c is not presumed: each of a row of values is as probable as what
markers show of all elements makes it, beside the chance that there is no such c.
"""

import math

import numpy as np
from numpy.typing import NDArray

from slipcore.compilation import compiled
from slipcore.defaults import NUMERICS
from slipcore.detection.filter.pose import AnchorMotion
from slipcore.detection.filter.state import EXPECTED, LIMIT_LIKELIHOODS, PROBABILITY, SPRING_X, SPRING_Y, TOUCH_DEPTH
from slipcore.detection.filter.tuning import Tuning
from slipcore.detection.shared.records import Memory
from slipcore.frames import BoolArray, FloatArray

COUNT = NUMERICS.slip_limits
_LEAST_RATIO, _SUREST = NUMERICS.least_ratio, math.exp(NUMERICS.surest_limit)
"""Least ratio of motion to depth, and largest odds of slip, or of stick, by one limit."""
_BLOCK = 64
"""A logarithm for so many likelihoods, none of which is below 0.003."""
ROOMS = 7
_TAKEN, _COMPRESSION, _ODDS, _GROWTH, _SOONER, _SHOWN, _SLIPS = range(ROOMS)
"""Rows of numbers of each element: what it has taken up and its compression, m; its odds of stick by the limit that is
looked at, their growth from one limit to the next and what is left of them for slip that does not show yet; how
probable slip is by its marker; and by all limits."""


@compiled(inline=True)
def follow_springs(
    elements: FloatArray,
    places: NDArray[np.int64],
    motion: AnchorMotion,
    surface: tuple[FloatArray, FloatArray, BoolArray, BoolArray],
    deviation: float,
    limit: float,
    after: FloatArray,
    rows: FloatArray,
) -> tuple[float, float]:
    """Carry on what each element has taken up of the ``motion``, up to ``limit`` times its compression, and fill the
    size of that and the compression, m, in ``rows``; sums of compression and motion, m.

    ``surface``: displacement [n, m, 3] in the last frame and now, which elements touch and which did throughout; those
    that have just touched begin anew. No compression counts as less than the ``deviation`` of a marker coordinate, m.
    """
    last, now, contact, stays = surface
    n, m = contact.shape
    for i in range(n):
        for j in range(m):
            if not stays[i, j]:
                after[TOUCH_DEPTH, i, j] = -last[i, j, 2] if contact[i, j] else 0.0
                after[SPRING_X, i, j] = after[SPRING_Y, i, j] = after[EXPECTED, i, j] = 0.0
    depth = moved = 0.0
    for e in range(len(places)):
        i, j = places[e]
        after[TOUCH_DEPTH, i, j] = elements[TOUCH_DEPTH, i, j]
        x, y = elements[SPRING_X, i, j] + motion.x[e], elements[SPRING_Y, i, j] + motion.y[e]
        taken, compression = math.sqrt(x * x + y * y), max(-now[i, j, 2] - elements[TOUCH_DEPTH, i, j], deviation)
        share = limit * compression / taken if taken > limit * compression else 1.0
        after[SPRING_X, i, j], after[SPRING_Y, i, j] = share * x, share * y
        rows[_TAKEN, e], rows[_COMPRESSION, e] = taken, compression
        depth += compression
        moved += math.sqrt(motion.x[e] * motion.x[e] + motion.y[e] * motion.y[e])
    return depth, moved


@compiled(inline=True)
def weigh_limits(found: FloatArray, tuning: Tuning, weights: FloatArray) -> float:
    """Fill how probable each limit is and, last, that there is none, [COUNT + 1], by the log-likelihoods ``found`` and
    a log-normal prior; the geometric mean of the limits.
    """
    first, step = math.log(tuning.slip_limit_least), step_of_limits(tuning)
    usual, before, total, mean = math.log(tuning.slip_limit_usual), 0.0, 0.0, 0.0
    for k in range(COUNT):
        prior = math.exp(-0.5 * ((first + k * step - usual) / tuning.slip_limit_spread) ** 2)
        weights[k] = prior * math.exp(found[k])
        before += prior
        total += weights[k]
        mean += weights[k] * (first + k * step)
    weights[COUNT] = before * math.exp(found[COUNT]) * tuning.slip_limit_doubt / (1.0 - tuning.slip_limit_doubt)
    whole = total + weights[COUNT]
    for k in range(COUNT + 1):
        weights[k] /= whole
    return math.exp(mean / total) if total > 0.0 else tuning.slip_limit_usual


@compiled
def step_of_limits(tuning: Tuning) -> float:
    """By how much the logarithms of two limits beside each other differ."""
    return math.log(tuning.slip_limit_largest / tuning.slip_limit_least) / (COUNT - 1)


@compiled(inline=True)
def expect_slip(
    places: NDArray[np.int64],
    deviation: float,
    weights: FloatArray,
    tuning: Tuning,
    after: FloatArray,
    rows: FloatArray,
    shown_by: FloatArray,
) -> None:
    """Fill ``EXPECTED`` by the log-odds of slip that the limits give each element, and ``shown_by`` [COUNT + 1] by the
    log-likelihood of what markers show of all, by each limit and, last, if all slip alike; ``rows``: see ``ROOMS``.

    An element has by a limit slipped with the logistic function of the logarithm of what it took up over it, and by
    how uncertain this is; what is shown comes late, by ``slip_limit_lag``.
    """
    first, step, count = math.log(tuning.slip_limit_least), step_of_limits(tuning), len(places)
    width2 = tuning.slip_limit_width * tuning.slip_limit_width
    alike = 0.0
    for e in range(count):
        i, j = places[e]
        compression = rows[_COMPRESSION, e]
        ratio, blur = max(rows[_TAKEN, e] / compression, _LEAST_RATIO), deviation / compression
        steep = 1.0 / math.sqrt(width2 + blur * blur)
        rows[_ODDS, e] = math.exp((first - math.log(ratio)) * steep)
        rows[_GROWTH, e], rows[_SOONER, e] = math.exp(step * steep), math.exp(-tuning.slip_limit_lag * steep)
        rows[_SHOWN, e], rows[_SLIPS, e] = shown_slip(after[PROBABILITY, i, j], tuning), 0.0
        alike += rows[_SHOWN, e]
    alike /= count
    for k in range(COUNT):
        shown_by[k] = weigh_limit(rows, count, weights[k])
    shown_by[COUNT] = weigh_alike(rows[_SHOWN][:count], alike)
    ruled, most = 1.0 - weights[COUNT], tuning.slip_limit_odds
    largest = math.exp(most)
    for e in range(count):
        i, j = places[e]
        slips, sticks, told = rows[_SLIPS, e], ruled - rows[_SLIPS, e], 0.0
        if slips >= largest * sticks:
            told = most
        elif sticks >= largest * slips:
            told = -most
        else:
            told = math.log(slips / sticks)
        after[EXPECTED, i, j] = ruled * told if ruled > 0.0 else 0.0


@compiled(fastmath={"reassoc"})
def weigh_limit(rows: FloatArray, count: int, weight: float) -> float:
    """Add to the probability of slip of each element what a limit of that ``weight`` gives, and take its odds on to the
    next limit; log-likelihood of what markers show of all.

    Its loop is over elements beside each other in memory, of which several are then worked out at once.
    """
    total = 0.0
    for start in range(0, count, _BLOCK):
        end, likelihood = min(start + _BLOCK, count), 1.0
        odds, growth, sooner = rows[_ODDS][start:end], rows[_GROWTH][start:end], rows[_SOONER][start:end]
        shown, slips = rows[_SHOWN][start:end], rows[_SLIPS][start:end]
        for e in range(len(odds)):
            late = 1.0 + min(max(odds[e], 1.0 / _SUREST), _SUREST)
            now = 1.0 + min(max(sooner[e] * odds[e], 1.0 / _SUREST), _SUREST)
            both = 1.0 / (late * now)  # one division for both probabilities
            likelihood *= (1.0 - shown[e]) + (2.0 * shown[e] - 1.0) * (both * now)
            slips[e] += weight * (both * late)
            odds[e] *= growth[e]
        total += math.log(likelihood)
    return total


@compiled(fastmath={"reassoc"})
def weigh_alike(shown: FloatArray, alike: float) -> float:
    """The same if all slip as probably as that."""
    total = 0.0
    for start in range(0, len(shown), _BLOCK):
        block, likelihood = shown[start : start + _BLOCK], 1.0
        for e in range(len(block)):
            likelihood *= block[e] * alike + (1.0 - block[e]) * (1.0 - alike)
        total += math.log(likelihood)
    return total


@compiled
def shown_slip(p: float, tuning: Tuning) -> float:
    """How probable slip of an element is by its marker, with even odds at the threshold, and no surer than believed."""
    odds = (1.0 - tuning.threshold) / tuning.threshold
    shown = p * odds / (1.0 - p + p * odds)
    return float(min(max(shown, 1.0 - tuning.slip_limit_trust), tuning.slip_limit_trust))


@compiled
def learn_limits(shown_by: FloatArray, progress: float, count: int, tuning: Tuning, found: FloatArray) -> None:
    """Add to the log-likelihoods ``found`` what a step showed by ``count`` elements, as so many of one another's
    neighbours and frames say the same: in proportion to its ``progress``, motion over compression. Old ones fade so,
    too.
    """
    gain, kept = tuning.slip_limit_evidence * progress / count, math.exp(-progress / tuning.slip_limit_memory)
    best = -math.inf
    for k in range(COUNT + 1):
        found[k] = kept * found[k] + gain * shown_by[k]
        best = max(best, found[k])
    for k in range(COUNT + 1):
        found[k] -= best


@compiled(inline=True)
def step_limits(
    elements: FloatArray,
    places: NDArray[np.int64],
    motion: AnchorMotion,
    surface: tuple[FloatArray, FloatArray, BoolArray, BoolArray],
    noise: tuple[float, bool, bool],
    tuning: Tuning,
    room: tuple[FloatArray, FloatArray],
    memory: Memory,
) -> None:
    """Follow what elements take up, see ``follow_springs``, and fill what slip that lets expect; learn the limits.

    ``noise``: deviation of a marker coordinate, m, whether nothing has moved for so long that all stays as it was, and
    whether measured forces are believed: these say more, and nothing is learnt or expected beside them, nor where
    elements are hardly pressed in beyond the noise. ``room``: at least [ROOMS, k], and [2, any].
    """
    deviation, held, measured = noise
    after, common = memory.elements, memory.common
    size, (rows, series) = COUNT + 1, room
    weights, shown_by = series[0, :size], series[1, :size]
    found = common[LIMIT_LIKELIHOODS : LIMIT_LIKELIHOODS + size]
    limit, count = weigh_limits(found, tuning, weights), len(places)
    depth, moved = follow_springs(elements, places, motion, surface, deviation, limit, after, rows)
    used = depth > tuning.slip_limit_depth * deviation * count and not measured
    if used and not held:
        expect_slip(places, deviation, weights, tuning, after, rows, shown_by)
        learn_limits(shown_by, min(moved / depth, 1.0), count, tuning, found)
    for e in range(count):
        i, j = places[e]
        if held:
            after[EXPECTED, i, j] = elements[EXPECTED, i, j]
        elif not used:
            after[EXPECTED, i, j] = 0.0
