"""How far the object moves over an element before it slips: in proportion to how deep it was pressed in.

An element sticks until the object has moved over it by c times the depth to which it was pressed in since it touched,
with c = μ E*/G* for friction μ and the moduli of normal and tangential load (Jäger, J. Tribol. 120 (1998) 677). So each
element is a spring in series with a slider, which slides at c times the element's own compression (Popov and Heß,
Method of Dimensionality Reduction, 2015); loads that turn back or change need no rule of their own. This *limit* c is
inferred: each of a row of values, and that there is none, is as probable as what the markers of all elements show makes
it.
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
from slipcore.elementary import exponentials, logarithms
from slipcore.frames import BoolArray, FloatArray

COUNT = NUMERICS.slip_limits
_LEAST_RATIO, _LARGEST_ODDS = NUMERICS.least_ratio, math.exp(NUMERICS.surest_limit)
"""Least ratio of elongation to compression, and largest odds of slip, or of stick, by one limit."""
_BLOCK = 64
"""Likelihoods that are multiplied before a logarithm is taken: none is below 0.003, so that none underflows."""
SCRATCH_ROWS = 7
(
    _ELONGATION,  # of its spring, m
    _COMPRESSION,  # m
    _ODDS,  # of stick, by the limit that is evaluated
    _ODDS_RATIO,  # of these from one limit to the next
    _LAG_FACTOR,  # of these, for slip that the marker does not show yet
    _SHOWN,  # probability of slip by its marker
    _SLIP,  # probability of slip by all limits
) = range(SCRATCH_ROWS)
"""Rows of the scratch array, one number an element each."""


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
    """Stretch each element's spring by the ``motion``, up to ``limit`` times its compression; fill elongation and
    compression in ``rows``, and return the sums of compression and of motion, m.

    ``surface``: displacement [n, m, 3] in the last frame and now, which elements touch, and which did in both; the
    springs of those that have just touched begin unstretched. A compression counts as the ``deviation`` of a marker
    coordinate, m, at least.
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
        elongation, compression = math.sqrt(x * x + y * y), max(-now[i, j, 2] - elements[TOUCH_DEPTH, i, j], deviation)
        share = limit * compression / elongation if elongation > limit * compression else 1.0
        after[SPRING_X, i, j], after[SPRING_Y, i, j] = share * x, share * y
        rows[_ELONGATION, e], rows[_COMPRESSION, e] = elongation, compression
        depth += compression
        moved += math.sqrt(motion.x[e] * motion.x[e] + motion.y[e] * motion.y[e])
    return depth, moved


@compiled(inline=True)
def weigh_limits(found: FloatArray, tuning: Tuning, weights: FloatArray) -> float:
    """Fill ``weights`` [COUNT + 1], the posterior probability of each limit and, last, of none, from the
    log-likelihoods ``found`` and a log-normal prior; return the geometric mean of the limits.
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
    """Difference of the logarithms of two neighbouring limits."""
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
    """Fill ``EXPECTED`` with the log-odds of slip that the limits give each element, and ``shown_by`` [COUNT + 1] with
    the log-likelihood of what the markers show of all, under each limit and, last, if all slip with one probability.

    Under a limit c the marker of an element shows slip with the probability logistic(log(r/c)/s): r is its elongation
    over its compression, s² the sum of ``slip_limit_width``² and of the relative variance of the compression. Slip
    itself is earlier, as by a limit of c exp(−``slip_limit_lag``).
    """
    count = len(places)
    begin_limits(rows, count, deviation, tuning)
    alike = 0.0
    for e in range(count):
        i, j = places[e]
        rows[_SHOWN, e], rows[_SLIP, e] = shown_slip(after[PROBABILITY, i, j], tuning), 0.0
        alike += rows[_SHOWN, e]
    alike /= count
    for k in range(COUNT):
        shown_by[k] = weigh_limit(rows, count, weights[k])
    shown_by[COUNT] = weigh_alike(rows[_SHOWN][:count], alike)
    some_limit = 1.0 - weights[COUNT]
    find_log_odds(rows[_SLIP][:count], some_limit, tuning.slip_limit_odds)
    for e in range(count):
        i, j = places[e]
        after[EXPECTED, i, j] = some_limit * rows[_SLIP, e]


@compiled
def begin_limits(rows: FloatArray, count: int, deviation: float, tuning: Tuning) -> None:
    """Fill the odds of stick by the first limit, (c/r)^(1/s), their ratio from one limit to the next, and the factor of
    slip that is earlier than its marker shows.
    """
    odds, ratio, lag = rows[_ODDS][:count], rows[_ODDS_RATIO][:count], rows[_LAG_FACTOR][:count]
    elongation, compression = rows[_ELONGATION][:count], rows[_COMPRESSION][:count]
    first, step, width2 = math.log(tuning.slip_limit_least), step_of_limits(tuning), tuning.slip_limit_width**2
    for e in range(count):
        odds[e] = max(elongation[e] / compression[e], _LEAST_RATIO)
    logarithms(odds)
    for e in range(count):
        blur = deviation / compression[e]
        steep = 1.0 / math.sqrt(width2 + blur * blur)
        odds[e] = (first - odds[e]) * steep
        ratio[e], lag[e] = step * steep, -tuning.slip_limit_lag * steep
    exponentials(odds)
    exponentials(ratio)
    exponentials(lag)


@compiled
def find_log_odds(slips: FloatArray, some_limit: float, most: float) -> None:
    """Replace probabilities of slip [k], of which the rest to ``some_limit`` is stick, by log-odds of ``most``."""
    if not some_limit > 0.0:
        slips[:] = 0.0
        return
    largest = math.exp(most)
    for e in range(len(slips)):
        sticks = max(some_limit - slips[e], slips[e] / largest)
        slips[e] = max(slips[e] / sticks, 1.0 / largest)
    logarithms(slips)


@compiled(fastmath={"reassoc"})
def weigh_limit(rows: FloatArray, count: int, weight: float) -> float:
    """Add what one limit of this ``weight`` gives to each element's probability of slip, and move the odds on to the
    next limit; return the log-likelihood of what the markers show of all.

    The loop runs over elements that lie side by side in memory and has no branches, so that it is vectorised.
    """
    total = 0.0
    for start in range(0, count, _BLOCK):
        end, likelihood = min(start + _BLOCK, count), 1.0
        odds, ratio, lag = rows[_ODDS][start:end], rows[_ODDS_RATIO][start:end], rows[_LAG_FACTOR][start:end]
        shown, slips = rows[_SHOWN][start:end], rows[_SLIP][start:end]
        for e in range(len(odds)):
            late = 1.0 + min(max(odds[e], 1.0 / _LARGEST_ODDS), _LARGEST_ODDS)
            now = 1.0 + min(max(lag[e] * odds[e], 1.0 / _LARGEST_ODDS), _LARGEST_ODDS)
            both = 1.0 / (late * now)  # one division for both probabilities
            likelihood *= (1.0 - shown[e]) + (2.0 * shown[e] - 1.0) * (both * now)
            slips[e] += weight * (both * late)
            odds[e] *= ratio[e]
        total += math.log(likelihood)
    return total


@compiled(fastmath={"reassoc"})
def weigh_alike(shown: FloatArray, alike: float) -> float:
    """Log-likelihood of slip as ``shown`` [k] by markers if every element slips with the probability ``alike``."""
    total = 0.0
    for start in range(0, len(shown), _BLOCK):
        block, likelihood = shown[start : start + _BLOCK], 1.0
        for e in range(len(block)):
            likelihood *= block[e] * alike + (1.0 - block[e]) * (1.0 - alike)
        total += math.log(likelihood)
    return total


@compiled
def shown_slip(p: float, tuning: Tuning) -> float:
    """Probability of slip by a marker: its odds shifted to ½ at the threshold, within ``slip_limit_trust``."""
    odds = (1.0 - tuning.threshold) / tuning.threshold
    shown = p * odds / (1.0 - p + p * odds)
    return float(min(max(shown, 1.0 - tuning.slip_limit_trust), tuning.slip_limit_trust))


@compiled
def learn_limits(shown_by: FloatArray, progress: float, count: int, tuning: Tuning, found: FloatArray) -> None:
    """Add what ``count`` elements showed in a step to the log-likelihoods ``found``, whose old part fades.

    Neighbours and successive frames say nearly the same, so that a step counts as ``slip_limit_evidence`` of one
    independent observation, times its ``progress``: motion over compression, by which the old part fades as well.
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
    scratch: tuple[FloatArray, FloatArray],
    memory: Memory,
) -> None:
    """Stretch the springs (``follow_springs``), fill the slip that follows (``expect_slip``), and learn the limits.

    ``noise``: deviation of a marker coordinate, m; whether pose and load are held, when all stays as it was; and
    whether measured forces are believed. These say more: beside them nothing is learnt or expected, nor where elements
    are hardly pressed in beyond the noise. ``scratch``: at least [SCRATCH_ROWS, k], and [2, COUNT + 1].
    """
    deviation, held, measured = noise
    after, common = memory.elements, memory.common
    size, (rows, series) = COUNT + 1, scratch
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
