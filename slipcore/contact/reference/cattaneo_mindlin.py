"""Cattaneo–Mindlin: a tangential force below the sliding force on a Hertz contact (the paper's Appendix A, corrected).

Displacements are exact for the traction μ p₀/a [√(a² − r²) − √(c² − r²)] along x. The traction itself is exact where
slip runs along x everywhere, which is at ν = 0; at ν > 0 slip has a small component along y (Johnson, §7.2).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from slipcore.contact.reference.checks import check_range
from slipcore.contact.reference.elastic_pair import Compliance
from slipcore.contact.reference.ellipsoidal import (
    polar_angle,
    sin_minus_x_cos,
    tangential_displacement,
    x_minus_sin,
)
from slipcore.contact.reference.hertz import HertzContact
from slipcore.frames import FloatArray


@dataclass(frozen=True, slots=True)
class CattaneoMindlin:
    """Hertz ``contact`` under ``tangential_force`` N along +x, 0 ≤ F_T ≤ μ F_N, with ``friction`` coefficient μ > 0.

    Traction and displacement are those of the first body (the sensor), which the other drags along +x; x, y and r in
    m, any shapes that broadcast, vectors on the last axis. At F_T = μ F_N the whole contact has just begun to slide.
    Raises ``InvalidInput``: ``tangential_force`` above μ F_N has no quasi-static solution.
    """

    contact: HertzContact
    friction: float
    tangential_force: float

    def __post_init__(self) -> None:
        check_range("friction", self.friction, above=0.0)
        sliding_force = self.friction * self.contact.normal_force
        check_range("tangential_force", self.tangential_force, at_least=0.0, at_most=sliding_force, unit="N")

    @property
    def load_ratio(self) -> float:
        """Ratio F_T/μF_N, 0 to 1; 0 without contact."""
        sliding_force = self.friction * self.contact.normal_force
        return self.tangential_force / sliding_force if sliding_force > 0.0 else 0.0

    @property
    def stick_radius(self) -> float:
        """Radius c of the sticking circle, c = a (1 − F_T/μF_N)^⅓."""
        return float(self.contact.contact_radius * np.cbrt(1.0 - self.load_ratio))

    @property
    def annulus(self) -> float:
        """Difference a² − c² in m², to full relative precision down to F_T = 0 and up to F_T = μF_N."""
        ratio = self.load_ratio
        c = float(np.cbrt(1.0 - ratio))
        return self.contact.contact_radius**2 * ratio * (1.0 + c) / (1.0 + c + c * c)  # 1 − c³ is the load ratio

    @property
    def stick_ratio(self) -> float:
        """Stick area over contact area, c²/a²."""
        return float(np.cbrt(1.0 - self.load_ratio) ** 2)

    @property
    def rigid_displacement(self) -> float:
        """Displacement of the objects relative to one another along +x, in m: (2 − ν)πμp₀/8Ga · (a² − c²) (A15)."""
        compliance = self.contact.compliance
        return np.pi / 4.0 * self._slope * (compliance.shear - 0.5 * compliance.poisson) * self.annulus

    @property
    def _slope(self) -> float:
        return self.friction * self.contact.pressure_slope

    def traction(self, r: ArrayLike) -> FloatArray:
        """Tangential traction along +x in Pa (A3)–(A5), as a quotient: the difference cancels for small F_T."""
        square = self._square(r)
        root = np.sqrt(square) + np.sqrt(np.maximum(square - self.annulus, 0.0))
        numerator = self._slope * np.minimum(square, self.annulus)
        traction: FloatArray = np.divide(numerator, root, out=np.zeros_like(root), where=root > 0.0)
        return traction

    def contact_factor(self, r: ArrayLike) -> FloatArray:
        """Ratio f_t/μf_n (paper, eq. 36): 1 in slip, below 1 in stick, NaN outside the contact."""
        square = self._square(r)
        root = np.sqrt(square)
        denominator = root * (root + np.sqrt(np.maximum(square - self.annulus, 0.0)))
        numerator = np.minimum(square, self.annulus)
        factor: FloatArray = np.divide(numerator, denominator, out=np.full_like(root, np.nan), where=square > 0.0)
        return factor

    def displacement(self, x: ArrayLike, y: ArrayLike, body: Compliance | None = None) -> FloatArray:
        """Surface displacement (u_x, u_y) of ``body``, by default of both (sensor minus object), on the whole surface.

        It equals the rigid displacement in stick and differs from it by ``slip`` in the slip annulus (A12)–(A13).
        """
        x, y = np.broadcast_arrays(np.asarray(x, float), np.asarray(y, float))
        r = np.hypot(x, y)
        a = self.contact.contact_radius
        axial = np.where(r < a, self._stuck_axial - self._slip_axial(r), self._far_axial(r))
        deviator = np.where(r < a, self._slip_deviator(r), self._far_deviator(r))
        compliance = body or self.contact.compliance
        return self._slope * tangential_displacement(x, y, axial, deviator, compliance.shear, compliance.poisson)

    def slip(self, x: ArrayLike, y: ArrayLike) -> FloatArray:
        """Slip (s_x, s_y) of the sensor relative to the object, in m; 0 in stick, NaN outside the contact.

        At ν = 0 it is −H₁ (r²/2a²) φ₁(r/c): (A17)–(A19) with the missing factor, the ν terms kept.
        """
        x, y = np.broadcast_arrays(np.asarray(x, float), np.asarray(y, float))
        r = np.hypot(x, y)
        compliance = self.contact.compliance
        fields = -self._slip_axial(r), self._slip_deviator(r)
        slip = self._slope * tangential_displacement(x, y, *fields, compliance.shear, compliance.poisson)
        slip[r > self.contact.contact_radius] = np.nan
        return slip

    def slip_gradient(self, r: ArrayLike) -> FloatArray:
        """Magnitude |ds/dr| of the slip's radial gradient with the ν terms neglected (the paper's (6), corrected).

        It grows from the stick circle to the edge; 0 in stick, NaN outside the contact.
        """
        r = np.asarray(r, float)
        compliance, chi = self.contact.compliance, self._slip_angle(r)
        gradient = self._slope / 4.0 * (compliance.shear - 0.5 * compliance.poisson) * r * (chi + np.sin(chi))
        return np.where(r > self.contact.contact_radius, np.nan, gradient)

    @property
    def _stuck_axial(self) -> float:
        return 0.5 * np.pi**2 * self.annulus

    def _square(self, r: ArrayLike) -> FloatArray:
        """Square a² − r², 0 outside the contact."""
        r, a = np.asarray(r, float), self.contact.contact_radius
        square: FloatArray = np.maximum(a - r, 0.0) * (a + r)
        return square

    def _slip_angle(self, r: FloatArray) -> FloatArray:
        """Angle χ = 2 acos(c/r) in the annulus, 0 in stick: by r² − c² from the annulus, which resolves a thin one."""
        a = self.contact.contact_radius
        outside_stick = np.maximum(self.annulus - (a - r) * (a + r), 0.0)
        angle: FloatArray = 2.0 * np.arctan2(np.sqrt(outside_stick), self.stick_radius)
        return np.where(outside_stick > 0.0, angle, 0.0)

    def _slip_axial(self, r: FloatArray) -> FloatArray:
        axial: FloatArray = np.pi / 4.0 * r * r * sin_minus_x_cos(self._slip_angle(r))
        return axial

    def _slip_deviator(self, r: FloatArray) -> FloatArray:
        deviator: FloatArray = np.pi / 16.0 * x_minus_sin(2.0 * self._slip_angle(r))
        return deviator

    def _angles(self, r: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Mean and half difference of the angles φ = 2 asin(·/r) of contact and stick circle, outside the contact."""
        a, c = self.contact.contact_radius, self.stick_radius
        beyond_a = np.sqrt(np.maximum(r - a, 0.0) * (r + a))
        beyond_c = np.sqrt(beyond_a**2 + self.annulus)
        root = a * beyond_c + c * beyond_a
        sine = np.divide(r * r * self.annulus, root, out=np.zeros_like(r), where=root > 0.0)
        half = np.arctan2(sine, beyond_a * beyond_c + a * c)
        return polar_angle(r, a) - half, half

    def _far_axial(self, r: FloatArray) -> FloatArray:
        mean, half = self._angles(r)
        step = 2.0 * np.cos(mean) * sin_minus_x_cos(half) + 2.0 * mean * np.sin(mean) * np.sin(half)
        axial: FloatArray = np.pi / 4.0 * r * r * step
        return axial

    def _far_deviator(self, r: FloatArray) -> FloatArray:
        mean, half = self._angles(r)
        step: FloatArray = 2.0 * x_minus_sin(2.0 * half) + 4.0 * np.sin(2.0 * half) * np.sin(mean) ** 2
        return np.pi / 16.0 * step
