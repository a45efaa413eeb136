"""What is assumed of the slope with velocity, β₁, where all samples slid at about one speed and do not show it.

Friction at rest, for which planners ask, then follows from that at the speed of slip by an assumption alone: a normal
prior of β₁, by which friction changes between the two by some part of itself (``change_from_rest``).
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
    """A prior of β₁ ~ N(0, 1/``precision``), precision in (m/s)², for samples that do not show β₁.

    ``speed``: the mean of theirs, m/s. ``slowest``: hardly any slid slower than that, m/s. ``change``: by which part of
    itself friction is assumed to change from ``speed`` to rest (one standard deviation).
    """

    precision: float
    speed: float
    slowest: float
    change: float


def assumed_slope(data: FitData, slope: float, covariance: FloatArray) -> AssumedSlope | None:
    """The prior of β₁ that the data need; None where they need none.

    ``slope``: β₁, s/m, by the data alone; ``covariance`` [3, 3]: of all coefficients by the data alone. None is needed

    - where friction at rest follows from that at the speed of slip to within a tenth (95 %), or to 1/√2 of what would
      be assumed: a prior could then only bias it;
    - where the slope lies farther from 0 than both its error and the prior allow (``PRIOR.contradicted``);
    - beside samples of unknown velocity, which show friction near to rest themselves.

    The prior is weakened so that it and the data together know friction at rest no better than the first of these.
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


def change_from_rest(speed: float) -> float:
    """The part of itself by which friction at a speed, m/s, differs from that at rest: one standard deviation.

    A tenth at the reference speed, in proportion below it, and by the logarithm of speed above it (Dieterich, 1979,
    Journal of Geophysical Research 84:2161); however slow, no less than what slow slip of real surfaces changed.
    """
    ratio = speed / REFERENCE.tangential_velocity
    grown = ratio if ratio <= 1.0 else 1.0 + math.log(ratio)
    return max(PRIOR.velocity_effect * grown, PRIOR.least_velocity_effect)


def _beside_friction(data: FitData, covariance: FloatArray) -> tuple[float, float]:
    """Root mean square of friction in the middle of the data, and the variance of β₁ given that friction.

    Scatter between grasps scales all coefficients alike. That leaves the change from rest the same part of friction,
    so it must not count as doubt about the slope.
    """
    at, variance = data.mean_row(), float(covariance[1, 1])
    along, level = float(covariance[1] @ at), float(at @ covariance @ at)
    if not level > ROUNDING * float(at @ np.abs(covariance) @ at):  # only rounding is left: the variances cancel
        return abs(data.mean_friction), variance
    return math.hypot(data.mean_friction, math.sqrt(level)), max(variance - along**2 / level, 0.0)
