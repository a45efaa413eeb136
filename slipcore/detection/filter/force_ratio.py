"""Log-odds of slip from f_t/f_n of an element, without a friction coefficient given."""

import math

import numpy as np
from numpy.typing import NDArray

from slipcore.compilation import compiled
from slipcore.detection.filter.loading import low_pass
from slipcore.detection.filter.state import FRICTION, NORMAL, OPPOSED, PROBABILITY, RATIO, RATIO_WEIGHT, TANGENTIAL
from slipcore.detection.filter.tuning import Tuning
from slipcore.detection.shared.records import Surface
from slipcore.frames import FloatArray

HALF_LOG_TWO_PI = 0.5 * math.log(2.0 * math.pi)


@compiled
def log_normal_cdf(z: float) -> float:
    """log Φ(z), with the asymptote far out."""
    if z > 3.0:
        return -0.5 * math.erfc(z / math.sqrt(2.0))
    if z > -8.0:
        return math.log(0.5 * math.erfc(-z / math.sqrt(2.0)))
    return -0.5 * z * z - math.log(-z) - HALF_LOG_TWO_PI


@compiled
def ratio_log_odds(
    ratio: float, noise: float, own: float, known: float, friction: float, gain: float, tuning: Tuning
) -> float:
    """Log-likelihood ratio of slip at a force ratio: near the one it slips at, against anywhere below it.

    ``noise``: variance of the ratio; ``own`` over ``known``: the ratio at which this element was seen to slip;
    ``friction``: that of all; ``gain``: share of what is learnt that a frame replaces. In slip the ratio is normal
    about the limit λ with deviation s, in stick uniform below λ and as blurred: log(λ/s) + log φ(z) − log Φ(z) with
    z = (λ − ratio)/s, and constant above λ.
    """
    prior = 2.0 * gain / (tuning.ratio_difference * friction) ** 2
    limit = (prior * friction + own) / (prior + known)
    deviation = math.sqrt(noise + (tuning.ratio_spread * friction) ** 2 + 0.5 * gain / (prior + known))
    z = (limit - ratio) / deviation
    best = math.log(limit / deviation) - HALF_LOG_TWO_PI
    if z < 0.0:
        return best + math.log(2.0)
    return best - 0.5 * z * z - log_normal_cdf(z)


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
    told: FloatArray,
) -> None:
    """Learn the force ratio at which elements slip, each its own and the mean of all; fill ``told`` [2, k] by the
    log-odds of slip of each and the variance of its ratio.

    ``noise`` of an element's normal force, N. Of an element whose force opposes the motion the ratio is that of stick.
    """
    log_odds, variance = told
    told[:] = 0.0
    gain, memory = low_pass(interval, tuning.force_smoothing), -math.expm1(-interval / tuning.ratio_memory)
    left = gain / (2.0 - gain)
    least = max(tuning.force_to_noise * noise * math.sqrt(left), tuning.ratio_least_force)
    for e in range(len(places)):
        i, j = places[e]
        normal = after[NORMAL, i, j]
        if normal > least:
            ratio = after[TANGENTIAL, i, j] / normal
            variance[e] = noise * noise * left * (1.0 + ratio * ratio) / (normal * normal)
    learn_ratios(elements, places, variance, least, memory, tuning, after, common)
    if not common[FRICTION + 1] > 0.0:
        return
    friction = common[FRICTION] / common[FRICTION + 1]
    for e in range(len(places)):
        i, j = places[e]
        if friction > 0.0 and after[NORMAL, i, j] > least:
            ratio = 0.0 if after[OPPOSED, i, j] else after[TANGENTIAL, i, j] / after[NORMAL, i, j]
            own, known = after[RATIO, i, j], after[RATIO_WEIGHT, i, j]
            gained = ratio_log_odds(ratio, variance[e], own, known, friction, memory, tuning)
            limited = min(max(gained, -tuning.ratio_limit), tuning.ratio_limit)
            log_odds[e] = limited * tuning.ratio_weight * gain


@compiled
def keep_ratios(elements: FloatArray, places: NDArray[np.int64], after: FloatArray, told: FloatArray) -> None:
    """Learn nothing, and fill ``told`` [2, k] with nothing: for frames in which nothing happens."""
    told[:] = 0.0
    for e in range(len(places)):
        i, j = places[e]
        after[RATIO, i, j], after[RATIO_WEIGHT, i, j] = elements[RATIO, i, j], elements[RATIO_WEIGHT, i, j]


@compiled
def learn_ratios(
    elements: FloatArray,
    places: NDArray[np.int64],
    variance: FloatArray,
    least: float,
    memory: float,
    tuning: Tuning,
    after: FloatArray,
    common: FloatArray,
) -> None:
    """Forget by ``memory`` and add the force ratios of what most likely slips, of given ``variance`` [k].

    Only where the normal force is above ``least`` N, and the object's force does not oppose its motion.
    """
    total = weight = 0.0
    for e in range(len(places)):
        i, j = places[e]
        p, normal = elements[PROBABILITY, i, j], after[NORMAL, i, j]
        own = ratio = 0.0
        if normal > least and not after[OPPOSED, i, j]:
            ratio = after[TANGENTIAL, i, j] / normal
            if p > tuning.ratio_slip:
                w = p * p / (variance[e] + tuning.ratio_variance)
                total += w * ratio
                weight += w
            if p > tuning.ratio_slip_of_element:
                own = memory / (variance[e] + tuning.ratio_variance_of_element)
        after[RATIO, i, j] = (1.0 - memory) * elements[RATIO, i, j] + own * ratio
        after[RATIO_WEIGHT, i, j] = (1.0 - memory) * elements[RATIO_WEIGHT, i, j] + own
    common[FRICTION] += memory * (total - common[FRICTION])
    common[FRICTION + 1] += memory * (weight - common[FRICTION + 1])
