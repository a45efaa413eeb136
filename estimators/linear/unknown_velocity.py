"""Friction at velocities that nobody measured: how far it may lie from friction at rest.

Samples whose velocity is unknown count as of v = 0. They share an offset δ = β₁ v̄ then, of which only the size is
known: E δ² = v̄² E β₁², with v̄ a usual speed of slip, and β₁ by the other samples and, before them, a law that
changes friction by a tenth over the reference span. Elements that press harder slip later, and may slip slower or
faster: v goes as f_n^k with k of either sign, which tilts the offset by a part k (f_n/m − 1) about the mean force m.

Nor does anybody measure friction at rest. Where samples do not show how it changes from the speed at which they slid,
β₁ has a prior by which it changes by some part (``change_from_rest``).
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import special

from estimators.defaults import IDENTIFIABILITY, PRIOR, REFERENCE, ROUNDING
from estimators.linear.fit_data import FitData

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class AssumedSlope:
    """A prior of β₁ ~ N(0, 1/``precision``), precision in (m/s)², of samples that do not show it.

    They slid at ``speed`` m/s on average, from where to rest friction changes by the part ``change`` of itself (one
    standard deviation); hardly any slid slower than at ``slowest`` m/s.
    """

    precision: float
    speed: float
    slowest: float
    change: float


def assumed_slope(data: FitData, slope: float, covariance: FloatArray) -> AssumedSlope | None:
    """What is assumed of β₁, s/m, where data by themselves know it as ``slope`` and β by this ``covariance`` [3, 3];
    None where they know it, or where they contradict what would be assumed.

    They know it where from friction at the speed of slip that at rest follows to within a tenth, or to 1/√2 of what
    would be assumed: a prior would then only bias what they say. Where they know less, the two together are taken to
    know no more than that. Samples of unknown velocity show friction near to rest themselves.
    """
    speed, spread = data.speed()
    friction, variance = _beside_friction(data, covariance)
    if data.unknown_velocity > 0.0 or not (speed > 0.0 and friction > 0.0):
        return None
    change, of_data = change_from_rest(speed), variance * (speed / friction) ** 2
    enough = min(IDENTIFIABILITY.effect / special.ndtri(IDENTIFIABILITY.ends[1]), change / math.sqrt(2.0)) ** 2
    contradicted = (slope * speed / friction) ** 2 > PRIOR.contradicted**2 * (of_data + change**2)
    if of_data <= enough or contradicted:
        return None
    weight = min(change**2 * (1.0 / enough - 1.0 / of_data), 1.0)
    slowest = max(data.domain.tangential_velocity[0], speed - 2.0 * spread)
    return AssumedSlope(weight * (speed / (change * friction)) ** 2, speed, slowest, change)


def _beside_friction(data: FitData, covariance: FloatArray) -> tuple[float, float]:
    """Root mean square of friction in the middle of the data, and the variance of β₁ that is left where it is known.

    By what grasps scatter all coefficients are scaled alike, which leaves the change from rest the part that it is.
    """
    at, variance = data.mean_row(), float(covariance[1, 1])
    along, level = float(covariance[1] @ at), float(at @ covariance @ at)
    if not level > ROUNDING * float(at @ np.abs(covariance) @ at):  # what is left of variances that cancel
        return abs(data.mean_friction), variance
    return math.hypot(data.mean_friction, math.sqrt(level)), max(variance - along**2 / level, 0.0)


def change_from_rest(speed: float) -> float:
    """By which part of itself friction differs at a speed, m/s, from what it is at rest: its standard deviation.

    A tenth at the reference speed, in proportion below, and by the logarithm of speed above it (Dieterich, 1979,
    Journal of Geophysical Research 84:2161); however slow, no less than slow slip of real surfaces was seen to change.
    """
    ratio = speed / REFERENCE.tangential_velocity
    grown = ratio if ratio <= 1.0 else 1.0 + math.log(ratio)
    return max(PRIOR.velocity_effect * grown, PRIOR.least_velocity_effect)


def offset_variance(friction: float, slope: float, slope_variance: float) -> float:
    """Variance E δ² of the offset, from the mean friction and what the samples of known velocity say of β₁ (s/m)."""
    before = (PRIOR.velocity_effect * friction / REFERENCE.tangential_velocity) ** 2
    if not before > 0.0:
        return 0.0
    share = before / (before + slope_variance)
    return float(PRIOR.unknown_velocity**2 * ((share * slope) ** 2 + (1.0 - share) * before))


def columns_off(force: float) -> FloatArray:
    """Coefficients [2, 3] of what friction is off along: all alike, and tilted about a mean ``force``, N."""
    slope = PRIOR.velocity_tilt / force if force > 0.0 else 0.0
    return np.array([[1.0, 0.0, 0.0], [-slope * force, 0.0, slope]])
