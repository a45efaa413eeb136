"""Friction at velocities that nobody measured: how far it may lie from friction at rest.

Samples whose velocity is unknown count as of v = 0. They share an offset δ = β₁ v̄ then, of which only the size is
known: E δ² = v̄² E β₁², with v̄ a usual speed of slip, and β₁ as the other samples tell it and, before them, a law that
changes friction by a tenth over the reference span.
"""

from estimators.defaults import PRIOR, REFERENCE


def offset_variance(friction: float, slope: float, slope_variance: float) -> float:
    """Variance E δ² of the offset, from the mean friction and what the samples of known velocity say of β₁ (s/m)."""
    before = (PRIOR.velocity_effect * friction / REFERENCE.tangential_velocity) ** 2
    if not before > 0.0:
        return 0.0
    share = before / (before + slope_variance)
    return float(PRIOR.unknown_velocity**2 * ((share * slope) ** 2 + (1.0 - share) * before))
