"""Friction at velocities that nobody measured: how far it may lie from friction at rest.

Samples whose velocity is unknown count as of v = 0. They share an offset δ = β₁ v̄ then, of which only the size is
known: E δ² = v̄² E β₁², with v̄ a usual speed of slip, and β₁ by the other samples and, before them, a law that
changes friction by a tenth over the reference span. Elements that press harder slip later, and may slip slower or
faster: v goes as f_n^k with k of either sign, which tilts the offset by a part k (f_n/m − 1) about the mean force m.
"""

import numpy as np
from numpy.typing import NDArray

from estimators.defaults import PRIOR, REFERENCE

FloatArray = NDArray[np.float64]


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
