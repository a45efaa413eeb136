"""Log-odds of slip from f_t/f_n of an element, without a friction coefficient given."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slipcore.compilation import compiled
from slipcore.detection.filter.loading import low_pass
from slipcore.detection.filter.pose import AnchorMotion
from slipcore.detection.filter.state import (
    FRICTION,
    NORMAL,
    OPPOSED,
    PROBABILITY,
    RATIO,
    RATIO_WEIGHT,
    SPEED,
    TANGENTIAL,
)
from slipcore.detection.filter.tuning import Tuning
from slipcore.detection.shared.records import Surface
from slipcore.elementary import logarithms, logarithms_of_normal_cdf
from slipcore.frames import FloatArray

HALF_LOG_TWO_PI = 0.5 * math.log(2.0 * math.pi)


class ForceEvidence(NamedTuple):
    """Evidence of slip by the forces on elements, [k] each: its ``log_odds``, and what they are found from: the force
    ``ratio`` and its ``variance``; the weighted sum of ratios at which the element was ``seen`` to slip, and its
    ``weight``.
    """

    log_odds: FloatArray
    variance: FloatArray
    ratio: FloatArray
    seen: FloatArray
    weight: FloatArray


@compiled(inline=True)
def below_limit(
    ratio: float, noise: float, own: float, known: float, friction: float, gain: float, tuning: Tuning
) -> tuple[float, float]:
    """How many deviations a force ratio is below the one that slips, 0 above it, and how many deviations that is.

    ``noise``: variance of the ratio; ``own`` over ``known``: the ratio at which this element was seen to slip;
    ``friction``: that of all; ``gain``: share of what is learnt that a frame replaces.
    """
    prior = 2.0 * gain / (tuning.ratio_difference * friction) ** 2
    limit = (prior * friction + own) / (prior + known)
    deviation = math.sqrt(noise + (tuning.ratio_spread * friction) ** 2 + 0.5 * gain / (prior + known))
    return max((limit - ratio) / deviation, 0.0), limit / deviation


@compiled(inline=True)
def find_ratio_log_odds(evidence: ForceEvidence, friction: float, gain: float, tuning: Tuning) -> None:
    """Fill the log-likelihood ratio of slip at a force ratio: near the one it slips at, against anywhere below it;
    the other rows are used up.

    In slip the ratio is normal about the limit λ with deviation s, in stick uniform below λ and as blurred: log(λ/s) +
    log φ(z) − log Φ(z) with z = (λ − ratio)/s, and constant above λ.
    """
    log_odds, below, log_cdf = evidence.log_odds, evidence.ratio, evidence.seen
    for e in range(len(log_odds)):
        given = evidence.ratio[e], evidence.variance[e], evidence.seen[e], evidence.weight[e]
        below[e], log_odds[e] = below_limit(*given, friction, gain, tuning)
        log_cdf[e] = below[e]
    logarithms(log_odds)
    logarithms_of_normal_cdf(log_cdf)
    for e in range(len(log_odds)):
        log_odds[e] -= HALF_LOG_TWO_PI + 0.5 * below[e] * below[e] + log_cdf[e]


@compiled
def follow_forces(elements: FloatArray, surface: Surface, has_force: bool, gain: float, after: FloatArray) -> None:
    """Low-pass the forces of what stays in contact; begin anew with what has just touched."""
    n, m = surface.stays.shape
    for i in range(n):
        for j in range(m):
            after[NORMAL, i, j] = after[TANGENTIAL, i, j] = after[RATIO, i, j] = after[RATIO_WEIGHT, i, j] = 0.0
            if has_force:
                weight = gain if surface.stays[i, j] and elements[NORMAL, i, j] > 0.0 else 1.0
                a, b = elements[NORMAL, i, j], elements[TANGENTIAL, i, j]
                after[NORMAL, i, j] = a + weight * (max(surface.pressing[i, j], 0.0) - a)
                after[TANGENTIAL, i, j] = b + weight * (surface.tangential[i, j] - b)


@compiled(inline=True)
def weigh_forces(
    elements: FloatArray,
    places: NDArray[np.int64],
    noise: float,
    interval: float,
    tuning: Tuning,
    after: FloatArray,
    common: FloatArray,
    evidence: ForceEvidence,
) -> None:
    """Learn the force ratio at which elements slip, each its own and the mean of all; fill the ``evidence`` of each.

    ``noise`` of an element's normal force, N. Of an element whose force opposes the motion the ratio is that of stick,
    and counts as far as there is motion.
    """
    gain, memory = low_pass(interval, tuning.force_smoothing), -math.expm1(-interval / tuning.ratio_memory)
    left = gain / (2.0 - gain)
    least = max(tuning.force_to_noise * noise * math.sqrt(left), tuning.ratio_least_force)
    total, weights = learn_ratios(elements, places, noise * noise * left, least, memory, tuning, after, evidence)
    common[FRICTION] += memory * (total - common[FRICTION])
    common[FRICTION + 1] += memory * (weights - common[FRICTION + 1])
    friction = common[FRICTION] / common[FRICTION + 1] if common[FRICTION + 1] > 0.0 else 0.0
    if not friction > 0.0:
        evidence.log_odds[:] = 0.0
        return
    find_ratio_log_odds(evidence, friction, memory, tuning)
    weight, most = tuning.ratio_weight * gain, tuning.ratio_limit
    for e in range(len(places)):
        i, j = places[e]
        opposed = after[OPPOSED, i, j]
        counts = (opposed - 1.0 if opposed > 0.0 else 1.0) if after[NORMAL, i, j] > least else 0.0
        evidence.log_odds[e] = counts * weight * min(max(evidence.log_odds[e], -most), most)


@compiled
def count_by_motion(
    motion: AnchorMotion, interval: float, gain: float, tuning: Tuning, common: FloatArray, log_odds: FloatArray
) -> None:
    """Let ``log_odds`` [k] count as far as the object moved within the memory of forces, once per ``ratio_motion``: a
    ratio at rest counts once and not in each frame, for all may have stuck again since it was reached.

    ``gain`` of this step, of ``interval`` s, in that memory, by which the speed is low-passed, too.
    """
    squares = 0.0
    for e in range(len(motion.x)):
        squares += motion.x[e] * motion.x[e] + motion.y[e] * motion.y[e]
    speed = math.sqrt(squares / max(len(motion.x), 1)) / interval
    common[SPEED] += gain * (speed - common[SPEED])
    if not (tuning.ratio_motion > 0.0 and interval < math.inf):  # before the first frame nothing has moved
        return
    share = -math.expm1(-common[SPEED] * interval / (gain * tuning.ratio_motion))
    for e in range(len(log_odds)):
        log_odds[e] *= share


@compiled
def keep_ratios(elements: FloatArray, places: NDArray[np.int64], after: FloatArray, log_odds: FloatArray) -> None:
    """Learn nothing, and tell nothing by ``log_odds`` [k]: for frames in which nothing happens."""
    log_odds[:] = 0.0
    for e in range(len(places)):
        i, j = places[e]
        after[RATIO, i, j], after[RATIO_WEIGHT, i, j] = elements[RATIO, i, j], elements[RATIO_WEIGHT, i, j]


@compiled(inline=True)
def learn_ratios(
    elements: FloatArray,
    places: NDArray[np.int64],
    noise: float,
    least: float,
    memory: float,
    tuning: Tuning,
    after: FloatArray,
    evidence: ForceEvidence,
) -> tuple[float, float]:
    """Forget by ``memory`` and add the force ratios of what most likely slips; fill in the ``evidence`` the variances
    of ratios, the ratios themselves, and those seen to slip. The weighted sum of all that slip, and its weight.

    Only where the normal force is above ``least`` N, and the object's force does not oppose its motion. ``noise``:
    variance of a force, N².
    """
    total = weights = 0.0
    for e in range(len(places)):
        i, j = places[e]
        p, normal, tangential = elements[PROBABILITY, i, j], after[NORMAL, i, j], after[TANGENTIAL, i, j]
        own = ratio = variance = 0.0
        if normal > least:
            ratio = tangential / normal
            variance = noise * (1.0 + ratio * ratio) / (normal * normal)
            opposed = after[OPPOSED, i, j] > 0.0
            ratio = 0.0 if opposed else ratio
            if p > tuning.ratio_slip and not opposed:
                w = p * p / (variance + tuning.ratio_variance)
                total += w * ratio
                weights += w
            if p > tuning.ratio_slip_of_element and not opposed:
                own = memory / (variance + tuning.ratio_variance_of_element)
        seen = (1.0 - memory) * elements[RATIO, i, j] + own * ratio
        weight = (1.0 - memory) * elements[RATIO_WEIGHT, i, j] + own
        after[RATIO, i, j], after[RATIO_WEIGHT, i, j] = seen, weight
        evidence.ratio[e], evidence.variance[e], evidence.seen[e], evidence.weight[e] = ratio, variance, seen, weight
    return total, weights
