"""A rigid circular punch with a flat face, pressed and then pushed sideways.

Both tractions have the shape F/(2πa√(a² − r²)), so their ratio is the same everywhere: there is no partial slip, the
punch sticks as a whole up to F_T = μF_N. Source: Johnson, Contact Mechanics (1985), §3.8 (eq. 3.34–3.37) and 7.4.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from slipcore.contact.reference.checks import check_range
from slipcore.contact.reference.elastic_pair import Compliance
from slipcore.contact.reference.ellipsoidal import polar_angle, tangential_displacement
from slipcore.frames import FloatArray


@dataclass(frozen=True, slots=True)
class FlatPunch:
    """Punch of ``punch_radius`` m under ``normal_force`` and ``tangential_force`` (along +x), both in N.

    ``compliance`` is that of the half-space. Displacements in m, tractions in Pa on the half-space. Exact without
    coupling, at ν = ½; else the coupling is neglected. Raises ``InvalidInput``.
    """

    punch_radius: float
    normal_force: float
    compliance: Compliance
    tangential_force: float = 0.0

    def __post_init__(self) -> None:
        check_range("punch_radius", self.punch_radius, above=0.0, unit="m")
        check_range("normal_force", self.normal_force, at_least=0.0, unit="N")
        check_range("tangential_force", self.tangential_force, unit="N")

    @property
    def approach(self) -> float:
        """Indentation F_N/2E*a."""
        return self.normal_force / (2.0 * self.compliance.contact_modulus * self.punch_radius)

    @property
    def rigid_displacement(self) -> float:
        """Displacement of the punch along +x while it sticks, (2 − ν)F_T/8Ga."""
        compliance = 2.0 * self.compliance.shear - self.compliance.poisson
        return compliance * self.tangential_force / (8.0 * self.punch_radius)

    def pressure(self, r: ArrayLike) -> FloatArray:
        """Pressure; infinite at the edge, 0 outside."""
        return self.normal_force * self._shape(np.asarray(r, float))

    def traction(self, r: ArrayLike) -> FloatArray:
        """Traction along +x while the punch sticks; infinite at the edge, 0 outside."""
        return self.tangential_force * self._shape(np.asarray(r, float))

    def normal_displacement(self, r: ArrayLike) -> FloatArray:
        """Displacement u_z into the half-space on its whole surface, (2/π) asin(a/r) of the approach outside."""
        displacement: FloatArray = self.approach / np.pi * polar_angle(np.asarray(r, float), self.punch_radius)
        return displacement

    def displacement(self, x: ArrayLike, y: ArrayLike) -> FloatArray:
        """Tangential displacement (u_x, u_y) [..., 2] of the whole surface: d/da of that under √(a² − r²)."""
        x, y = np.broadcast_arrays(np.asarray(x, float), np.asarray(y, float))
        r, a = np.hypot(x, y), self.punch_radius
        beyond = np.sqrt(np.maximum(r - a, 0.0) * (r + a))
        axial = np.pi * polar_angle(r, a)
        deviator = 2.0 * np.pi * a * beyond / np.maximum(r, a) ** 4
        shear, poisson = self.compliance.shear, self.compliance.poisson
        scale = self.tangential_force / (2.0 * np.pi * a)
        return scale * tangential_displacement(x, y, axial, deviator, shear, poisson)

    def _shape(self, r: FloatArray) -> FloatArray:
        a = self.punch_radius
        root = np.sqrt(np.maximum(a - r, 0.0) * (a + r))
        inside: FloatArray = np.divide(0.5 / (np.pi * a), root, out=np.zeros_like(r), where=root > 0.0)
        return np.where(r == a, np.inf, inside)
