"""Line contact of a cylinder (plane strain): Hertz, and Cattaneo's partial slip in two dimensions.

A half-plane has no absolute displacement under a net force, so displacements are given relative to the axis of the
contact. Loads are per unit length. Source: Johnson, Contact Mechanics (1985), §2.5–2.7, 4.2(c) and 7.2.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from slipcore.contact.reference.checks import check_range
from slipcore.contact.reference.elastic_pair import Compliance
from slipcore.frames import FloatArray


@dataclass(frozen=True, slots=True)
class CylinderContact:
    """Cylinder of ``cylinder_radius`` m under ``normal_load`` N/m, then ``tangential_load`` N/m along +x, 0 ≤ Q ≤ μP.

    ``friction`` μ > 0; x in m across the axis; tractions in Pa on the first body. Without normal–tangential coupling
    (equal bodies, or ν = ½ beside a rigid one). Raises ``InvalidInput``.
    """

    cylinder_radius: float
    normal_load: float
    compliance: Compliance
    friction: float = 1.0
    tangential_load: float = 0.0

    def __post_init__(self) -> None:
        check_range("cylinder_radius", self.cylinder_radius, above=0.0, unit="m")
        check_range("normal_load", self.normal_load, at_least=0.0, unit="N/m")
        check_range("friction", self.friction, above=0.0)
        limit = self.friction * self.normal_load
        check_range("tangential_load", self.tangential_load, at_least=0.0, at_most=limit, unit="N/m")

    @property
    def half_width(self) -> float:
        """Half width a of the contact strip, a² = 4PR/πE*."""
        modulus = self.compliance.contact_modulus
        return float(np.sqrt(4.0 * self.normal_load * self.cylinder_radius / (np.pi * modulus)))

    @property
    def peak_pressure(self) -> float:
        """Pressure p₀ on the axis, aE*/2R."""
        return self._slope * self.half_width

    @property
    def annulus(self) -> float:
        """Difference a² − c² in m²: the load ratio times a²."""
        limit = self.friction * self.normal_load
        return self.half_width**2 * (self.tangential_load / limit if limit > 0.0 else 0.0)

    @property
    def stick_half_width(self) -> float:
        """Half width c of the sticking strip, a √(1 − Q/μP)."""
        limit = self.friction * self.normal_load
        return self.half_width * float(np.sqrt((limit - self.tangential_load) / limit)) if limit > 0.0 else 0.0

    def pressure(self, x: ArrayLike) -> FloatArray:
        """Pressure p₀ √(1 − x²/a²), 0 outside the contact."""
        pressure: FloatArray = self._slope * np.sqrt(self._square(x))
        return pressure

    def traction(self, x: ArrayLike) -> FloatArray:
        """Traction along +x: μp in slip, less in stick; as a quotient, since the difference cancels at small loads."""
        square = self._square(x)
        root = np.sqrt(square) + np.sqrt(np.maximum(square - self.annulus, 0.0))
        numerator = self.friction * self._slope * np.minimum(square, self.annulus)
        traction: FloatArray = np.divide(numerator, root, out=np.zeros_like(root), where=root > 0.0)
        return traction

    def normal_displacement(self, x: ArrayLike) -> FloatArray:
        """Displacement u_z relative to the axis (both bodies together): −x²/2R in contact, logarithmic far away."""
        return -_strip(np.asarray(x, float), self.half_width) / (2.0 * self.cylinder_radius)

    def slip(self, x: ArrayLike) -> FloatArray:
        """Slip of the first body relative to the other, in m: ≤ 0; 0 in stick, NaN outside the contact."""
        distance, a = np.abs(np.asarray(x, float)), self.half_width
        outside_stick = np.sqrt(np.maximum(self.annulus - (a - distance) * (a + distance), 0.0))
        slip = -self.friction / (2.0 * self.cylinder_radius) * _excess(outside_stick, self.stick_half_width)
        return np.where(distance > a, np.nan, slip)

    @property
    def _slope(self) -> float:
        return self.compliance.contact_modulus / (2.0 * self.cylinder_radius)

    def _square(self, x: ArrayLike) -> FloatArray:
        distance, a = np.abs(np.asarray(x, float)), self.half_width
        square: FloatArray = np.maximum(a - distance, 0.0) * (a + distance)
        return square


def _strip(x: FloatArray, a: float) -> FloatArray:
    """Value of x² − [|x| √(x² − a²) − a² acosh(|x|/a)] outside ±a, x² inside: the dip under a load √(a² − x²)."""
    x = np.abs(x)
    beyond = np.sqrt(np.maximum(x - a, 0.0) * (x + a))
    dip: FloatArray = x * x - _excess(beyond, a)
    return dip


def _excess(beyond: FloatArray, c: float) -> FloatArray:
    """Value of x √(x² − c²) − c² acosh(x/c) from √(x² − c²), to full relative precision: (c²/2)(sinh 2v − 2v)."""
    if c == 0.0:
        return beyond**2
    v = np.arcsinh(beyond / c)
    direct = beyond * np.hypot(beyond, c) - c * c * v
    series = np.ones_like(v)
    for k in range(10, 1, -1):  # 1 + z²/(4·5)·(1 + z²/(6·7)·(…)) with z = 2v: the rest is below 1e-20 at z = 1
        series = 1.0 + 4.0 * v * v / (2 * k * (2 * k + 1)) * series
    return np.where(v < 0.5, 2.0 / 3.0 * c * c * v**3 * series, direct)
