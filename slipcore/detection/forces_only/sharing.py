"""How elements share a change of the load: sticking ones take their part and more, slipping ones ever less."""

import math
from typing import NamedTuple

import numpy as np

from slipcore.compilation import compiled
from slipcore.defaults import NUMERICS
from slipcore.detection.forces_only.tuning import ForcesTuning
from slipcore.frames import BoolArray, FloatArray

_LEAST_FORCE, _LEAST_SPREAD = NUMERICS.least_element_force, NUMERICS.least_spread


class Loads(NamedTuple):
    """Forces on elements [k] at places [k, 2] m: ``normal`` N inwards, ``tangential`` [k, 3] N."""

    place: FloatArray
    normal: FloatArray
    tangential: FloatArray


class Sharing(NamedTuple):
    """What a change of the load says of elements [k]: their force ``ratio``, and its ``deviation``; the ``part`` of the
    change of that ratio over what an element takes that goes on sharing as it did, with its ``part_deviation``; the
    change ``expected`` of it if the load were shared evenly, below 0 where it is taken back; whether the ratio
    ``falls``.
    """

    ratio: FloatArray
    deviation: FloatArray
    part: FloatArray
    part_deviation: FloatArray
    expected: FloatArray
    falls: BoolArray


@compiled
def ratios(loads: Loads) -> FloatArray:
    """Of tangential to normal force, [k]."""
    ratio = np.empty(len(loads.normal))
    for e in range(len(ratio)):
        ratio[e] = length(loads.tangential[e]) / max(loads.normal[e], _LEAST_FORCE)
    return ratio


@compiled
def length(vector: FloatArray) -> float:
    """Of a vector [3]."""
    return math.sqrt(vector[0] * vector[0] + vector[1] * vector[1] + vector[2] * vector[2])


@compiled
def arms(loads: Loads) -> tuple[FloatArray, float]:
    """Places [k, 2] m from the pressure centre, and the sum of normal force times their squares, N m²."""
    arm, total, polar = loads.place.copy(), loads.normal.sum(), 0.0
    for a in range(2):
        centre = (loads.normal * loads.place[:, a]).sum() / total
        for e in range(len(arm)):
            arm[e, a] -= centre
            polar += loads.normal[e] * arm[e, a] * arm[e, a]
    return arm, polar + _LEAST_SPREAD


@compiled
def summed(arm: FloatArray, force: FloatArray) -> tuple[float, float, float, float]:
    """Sum of forces [k, 3], and of their moments about the normal."""
    x = y = z = moment = 0.0
    for e in range(len(arm)):
        x, y, z = x + force[e, 0], y + force[e, 1], z + force[e, 2]
        moment += arm[e, 0] * force[e, 1] - arm[e, 1] * force[e, 0]
    return x, y, z, moment


@compiled
def evenly(loads: Loads) -> FloatArray:
    """Each element's vector of force over normal force, [k, 3], if the load were shared by the normal force.

    With F_N = Σp, centre c = Σp x/F_N and arms r = x − c: q + ω ẑ × r for q = Σf/F_N and ω = Σ(r × f)/Σp r².
    """
    arm, polar = arms(loads)
    x, y, z, moment = summed(arm, loads.tangential)
    total, turn, even = loads.normal.sum(), moment / polar, np.empty((len(arm), 3))
    for e in range(len(arm)):
        even[e, 0], even[e, 1], even[e, 2] = x / total - turn * arm[e, 1], y / total + turn * arm[e, 0], z / total
    return even


@compiled
def sideways(before: Loads, now: Loads) -> float:
    """Size of the change of the tangential forces as a whole, N: of its sum, and of its moment over the radius of
    gyration.
    """
    arm, polar = arms(now)
    x, y, z, moment = summed(arm, now.tangential)
    x0, y0, z0, moment0 = summed(arm, before.tangential)
    x, y, z, moment = x - x0, y - y0, z - z0, moment - moment0
    return math.sqrt(x * x + y * y + z * z + moment * moment * now.normal.sum() / polar)


@compiled
def compare(before: Loads, now: Loads, noise: float, tuning: ForcesTuning) -> Sharing:
    """How elements shared the change from ``before`` to ``now``; ``noise`` of one component of force, N."""
    ratio, last, even, even_before = ratios(now), ratios(before), evenly(now), evenly(before)
    count = len(ratio)
    deviation, part, part_deviation = np.empty(count), np.empty(count), np.empty(count)
    expected, falls = np.empty(count), np.empty(count, np.bool_)
    for e in range(count):
        size, along, grown = max(length(now.tangential[e]), _LEAST_FORCE), 0.0, 0.0
        for a in range(3):
            along += even[e, a] * now.tangential[e, a] / size
            grown += (even[e, a] - even_before[e, a]) * now.tangential[e, a] / size
        share = ratio[e] / max(along, tuning.least_change)
        share = min(max(share, 1.0 / tuning.largest_share), tuning.largest_share)
        most, change = max(abs(grown) * share, tuning.least_change), ratio[e] - last[e]
        deviation[e] = noise * math.sqrt(1.0 + ratio[e] * ratio[e]) / max(now.normal[e], _LEAST_FORCE)
        part[e], part_deviation[e] = change / most, math.sqrt(2.0) * deviation[e] / most
        expected[e], falls[e] = grown, change < 0.0
    return Sharing(ratio, deviation, part, part_deviation, expected, falls)


@compiled
def log_density(x: float, mean: float, deviation: float) -> float:
    """Of a normal distribution, up to a constant."""
    away = (x - mean) / deviation
    return -0.5 * away * away - math.log(deviation)


@compiled
def log_sum(one: float, other: float) -> float:
    """Logarithm of the sum of two numbers of which the logarithms are given."""
    return max(one, other) + math.log1p(math.exp(-abs(one - other)))


@compiled
def stick_density(seen: Sharing, tuning: ForcesTuning) -> FloatArray:
    """Log density [k] of the part that sticking elements take: as before, or more for others that slip."""
    density, share = np.empty(len(seen.part)), tuning.overload_share
    for e in range(len(density)):
        part, noise = seen.part[e], seen.part_deviation[e]
        as_before = log_density(part, 1.0, math.hypot(tuning.part_spread, noise))
        more = log_density(part, tuning.overload, math.hypot(tuning.overload_spread, noise))
        mixed = log_sum(math.log1p(-share) + as_before, math.log(share) + more)
        density[e] = log_sum(math.log1p(-tuning.outlier_share) + mixed, anything(part, noise, tuning))
    return density


@compiled
def slip_density(seen: Sharing, friction: FloatArray, tuning: ForcesTuning) -> FloatArray:
    """Log density [g, k] of the part that slipping elements take, for each ``friction`` [g].

    An element slips from its rim inwards, and what sticks in it takes on load until nothing does: the compliance of a
    contact in partial slip (Mindlin, 1949) goes with (1 − f_t/μf_n)^⅓, here with an exponent of its own.
    """
    density, inlier = np.empty((len(friction), len(seen.part))), math.log1p(-tuning.outlier_share)
    for e in range(len(seen.part)):
        part, noise = seen.part[e], seen.part_deviation[e]
        spread, otherwise = math.hypot(tuning.slip_part_spread, noise), anything(part, noise, tuning)
        for k in range(len(friction)):
            left = max(1.0 - seen.ratio[e] / friction[k], 0.0)
            taken = log_density(part, tuning.slip_part * left**tuning.slip_exponent, spread)
            density[k, e] = log_sum(inlier + taken, otherwise)
    return density


@compiled
def anything(part: float, noise: float, tuning: ForcesTuning) -> float:
    """Log density of the part that an element takes of which it says nothing, and of its being one of those."""
    return math.log(tuning.outlier_share) + log_density(part, 1.0, math.hypot(1.0, noise))
