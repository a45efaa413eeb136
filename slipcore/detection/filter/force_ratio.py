"""Evidence of slip in f_t/f_n of an element, without a friction coefficient given."""

import math

from slipcore.compilation import compiled

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
def ratio_evidence(
    ratio: float, noise: float, own: float, known: float, friction: float, gain: float, spread: float, difference: float
) -> float:
    """Log-likelihood ratio of slip at a force ratio: near the one it slips at, against anywhere below it.

    ``noise``: variance of the ratio; ``own`` over ``known``: the ratio at which this element was seen to slip;
    ``friction``: that of all; ``spread``, ``difference``: scatter in slip and among elements, as shares of it.
    """
    prior = 2.0 * gain / (difference * friction) ** 2
    limit = (prior * friction + own) / (prior + known)
    deviation = math.sqrt(noise + (spread * friction) ** 2 + 0.5 * gain / (prior + known))
    z = (limit - ratio) / deviation
    best = math.log(limit / deviation) - HALF_LOG_TWO_PI
    if z < 0.0:
        return best + math.log(2.0)
    return best - 0.5 * z * z - log_normal_cdf(z)
