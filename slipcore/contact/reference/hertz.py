"""Hertz: a sphere pressed on a half-space without friction."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from slipcore.contact.reference.checks import check_range
from slipcore.contact.reference.elastic_pair import Compliance
from slipcore.contact.reference.ellipsoidal import potential
from slipcore.frames import FloatArray


@dataclass(frozen=True, slots=True)
class HertzContact:
    """Sphere of ``sphere_radius`` m (of two spheres: 1/R = 1/R₁ + 1/R₂) under ``normal_force`` N (≥ 0).

    ``compliance``: of the half-space, or of both bodies (``elastic_pair``). Lengths in m, pressures in Pa, r ≥ 0 in m
    from the axis, in any shape. Raises ``InvalidInput``. Source: Johnson, Contact Mechanics (1985), §3.4 and 4.2.
    """

    sphere_radius: float
    normal_force: float
    compliance: Compliance

    def __post_init__(self) -> None:
        check_range("sphere_radius", self.sphere_radius, above=0.0, unit="m")
        check_range("normal_force", self.normal_force, at_least=0.0, unit="N")
        check_range("contact_modulus", self.compliance.contact_modulus, above=0.0, unit="Pa")

    @property
    def contact_radius(self) -> float:
        """Radius a of the contact circle, a³ = 3 F_N R/4E*."""
        modulus = self.compliance.contact_modulus
        return float(np.cbrt(0.75 * self.normal_force * self.sphere_radius / modulus))

    @property
    def approach(self) -> float:
        """Distance that the bodies have come closer, a²/R."""
        return self.contact_radius**2 / self.sphere_radius

    @property
    def pressure_slope(self) -> float:
        """Ratio p₀/a = 2E*/πR in Pa/m; it doesn't depend on the load, hence no division by a vanishing radius."""
        return 2.0 * self.compliance.contact_modulus / (np.pi * self.sphere_radius)

    @property
    def peak_pressure(self) -> float:
        """Pressure p₀ on the axis."""
        return self.pressure_slope * self.contact_radius

    def pressure(self, r: ArrayLike) -> FloatArray:
        """Pressure p₀ √(1 − r²/a²), 0 outside the contact."""
        r, a = np.asarray(r, float), self.contact_radius
        pressure: FloatArray = self.pressure_slope * np.sqrt(np.maximum(a - r, 0.0) * (a + r))
        return pressure

    def normal_displacement(self, r: ArrayLike, body: Compliance | None = None) -> FloatArray:
        """Normal displacement u_z into ``body`` (default: of both, which is approach − r²/2R in contact)."""
        compliance = body or self.compliance
        scale = self.pressure_slope * (compliance.shear - compliance.poisson) / (2.0 * np.pi)
        u_z: FloatArray = scale * potential(np.asarray(r, float), self.contact_radius)
        return u_z

    def radial_displacement(self, r: ArrayLike, body: Compliance | None = None) -> FloatArray:
        """Displacement u_r away from the axis by the pressure; negative for ν < ½ (Johnson, eq. 3.41c, 3.42b)."""
        r, a = np.asarray(r, float), self.contact_radius
        inside = np.minimum(r, a)
        with np.errstate(divide="ignore"):  # log1p(−1) = −∞ at the edge is right: the exponential of it is 0
            reach = -np.expm1(1.5 * np.log1p(-(np.divide(inside, a, out=np.ones_like(r), where=a > 0.0) ** 2)))
        u_r: FloatArray = np.divide(reach * a**3, r, out=np.zeros_like(r), where=r > 0.0)
        return -(body or self.compliance).coupling / 6.0 * self.pressure_slope * u_r
