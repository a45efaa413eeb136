"""Elastic compliances of one half-space, or of two in contact."""

import math
from dataclasses import dataclass

from slipcore.contact.reference.checks import check_range


@dataclass(frozen=True, slots=True)
class Compliance:
    """Compliances of a half-space, or of a pair of them summed, in 1/Pa.

    ``shear`` Σ 1/G, ``poisson`` Σ ν/G and ``coupling`` (1 − 2ν)/G of the first body minus that of the second: traction
    and pressure on the second body are equal and opposite, and so is the sign of what couples them. Source: Johnson,
    Contact Mechanics (1985), §3.2, 3.6 and 7.1.
    """

    shear: float
    poisson: float
    coupling: float

    @property
    def contact_modulus(self) -> float:
        """E* in Pa: 1/E* = Σ (1 − ν²)/E = Σ (1 − ν)/2G; infinite between rigid bodies."""
        normal = self.shear - self.poisson
        return 2.0 / normal if normal > 0.0 else math.inf

    @property
    def dundurs(self) -> float:
        """Dundurs' constant β = ½ Σ± (1 − 2ν)/G ÷ Σ (1 − ν)/G; 0 means that normal and tangential problem decouple."""
        return 0.5 * self.coupling / (self.shear - self.poisson)


RIGID = Compliance(0.0, 0.0, 0.0)
"""A body that doesn't deform."""


def half_space(young_modulus: float, poisson_ratio: float) -> Compliance:
    """Compliance of a half-space from Young's modulus in Pa (above 0) and Poisson's ratio (above −1, at most 0.5)."""
    check_range("young_modulus", young_modulus, above=0.0, unit="Pa")
    check_range("poisson_ratio", poisson_ratio, above=-1.0, at_most=0.5)
    inverse_shear = 2.0 * (1.0 + poisson_ratio) / young_modulus
    return Compliance(inverse_shear, poisson_ratio * inverse_shear, (1.0 - 2.0 * poisson_ratio) * inverse_shear)


def elastic_pair(sensor: Compliance, target: Compliance) -> Compliance:
    """Compliance of relative displacement (sensor minus target) under the traction that acts on the sensor."""
    return Compliance(sensor.shear + target.shear, sensor.poisson + target.poisson, sensor.coupling - target.coupling)
