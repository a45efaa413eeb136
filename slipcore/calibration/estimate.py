"""Quantities with intervals, and how those of several presses are joined."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.special import stdtrit

from slipcore.calibration.defaults import ESTIMATE


@dataclass(frozen=True, slots=True)
class Estimate:
    """A quantity of a sensor, its ``unit``, and the 95 % interval from ``low`` to ``high``.

    ``not_identified``: why it is not known (all three are then NaN); None where it is.
    """

    name: str
    unit: str
    value: float
    low: float
    high: float
    not_identified: str | None = None

    @property
    def is_identified(self) -> bool:
        """Whether the presses determine it."""
        return self.not_identified is None

    @property
    def is_significant(self) -> bool:
        """Whether it is identified, and differs from 0."""
        return self.is_identified and not self.low <= 0.0 <= self.high


class PressEstimate(NamedTuple):
    """What one press says of a quantity: its value and standard error, and what of it more presses do not average out
    (``shared``), for it is the sensor's.
    """

    value: float
    error: float
    shared: float = 0.0


PressResult = PressEstimate | str
"""Or why it says nothing."""


def unknown(name: str, unit: str, reason: str) -> Estimate:
    """A quantity that is not identified."""
    return Estimate(name, unit, math.nan, math.nan, math.nan, reason)


def joined(name: str, unit: str, found: Sequence[PressResult]) -> Estimate:
    """One quantity of several presses: a random effect of each press beside its own error (DerSimonian and Laird).

    Presses that say nothing are left out; where all do, the first says why.
    """
    known = [each for each in found if isinstance(each, PressEstimate)]
    if not known:
        return unknown(name, unit, next(each for each in found if isinstance(each, str)))
    value, error, freedom = _random_effects(np.array([each[:2] for each in known]))
    shared = float(np.mean([each.shared for each in known]))
    half = math.hypot(
        *(
            float(stdtrit(k, 0.5 + 0.5 * ESTIMATE.confidence)) * each
            for k, each in ((freedom, error), (math.inf, shared))
        )
    )
    return Estimate(name, unit, value, value - half, value + half)


def _random_effects(known: np.ndarray) -> tuple[float, float, float]:
    """Mean of values [k, 2] with their errors, its standard error, and the degrees of freedom of its t."""
    values, variances = known[:, 0], np.maximum(known[:, 1] ** 2, np.finfo(float).tiny)
    if len(values) == 1:
        return float(values[0]), float(known[0, 1]), math.inf
    least = variances.min()
    weights = least / variances  # not 1/variances, whose squares overflow where there is no noise
    fixed = np.average(values, weights=weights)
    excess = weights @ (values - fixed) ** 2 - (len(values) - 1) * least
    between = max(excess / (weights.sum() - (weights**2).sum() / weights.sum()), 0.0)
    weights = 1.0 / (variances + between)
    freedom = math.inf if between == 0.0 else len(values) - 1.0
    return float(np.average(values, weights=weights)), float(weights.sum() ** -0.5), freedom


def error_of_mean(residual: np.ndarray) -> float:
    """Standard error of the mean of a series [k] that may be correlated from frame to frame (as AR(1))."""
    count = len(residual)
    variance = float(residual @ residual) / max(count - 1, 1)
    if variance == 0.0:
        return 0.0
    memory = float(residual[1:] @ residual[:-1]) / (variance * count)
    factor = (1.0 + memory) / (1.0 - memory) if memory > 0.0 else 1.0
    return math.sqrt(variance * min(factor, 0.5 * count) / count)
