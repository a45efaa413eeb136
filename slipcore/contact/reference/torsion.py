"""Torsion of a circular contact: without slip (Reissner–Sagoci), and with it (Lubkin).

Traction and slip run along circles, so these forms are exact for any Poisson's ratio. The partial-slip state is a sum
of Reissner–Sagoci states of radius s, from the stick radius c to a, each turned by dΦ = (μp₀/2G) E(1 − s²/a²) ds/s.
Source: Reissner & Sagoci, J. Appl. Phys. 15 (1944) 652; Lubkin, J. Appl. Mech. 18 (1951) 183; Johnson, Contact
Mechanics (1985), §3.9 and 7.4.
"""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike
from scipy import optimize, special

from slipcore.contact.defaults import REFERENCE
from slipcore.contact.reference.checks import check_range
from slipcore.contact.reference.ellipsoidal import polar_angle, x_minus_sin
from slipcore.contact.reference.hertz import HertzContact
from slipcore.frames import FloatArray

_V, _W = np.polynomial.legendre.leggauss(REFERENCE.torsion_nodes)
NODES, WEIGHTS = (0.5 * (_V + 1.0)) ** 3, 1.5 * (0.5 * (_V + 1.0)) ** 2 * _W
"""Gauss–Legendre on [0, 1], graded towards 0, where E(1 − s²) has a weak logarithm: 1e-13 in all that follows."""

FULL_SLIP = 3.0 * np.pi**2 / 64.0
"""Integral of s² E(1 − s²) from 0 to 1: the moment of full slip in units of (8/3) μp₀a³."""


@dataclass(frozen=True, slots=True)
class ReissnerSagoci:
    """Circle of ``contact_radius`` m turned by ``moment`` N·m without slip; ``shear_compliance``: Σ 1/G in 1/Pa."""

    contact_radius: float
    shear_compliance: float
    moment: float

    def __post_init__(self) -> None:
        check_range("contact_radius", self.contact_radius, above=0.0, unit="m")
        check_range("shear_compliance", self.shear_compliance, above=0.0, unit="1/Pa")
        check_range("moment", self.moment, unit="N m")

    @property
    def twist(self) -> float:
        """Angle between the bodies in rad, 3M/16Ga³."""
        return 3.0 * self.moment * self.shear_compliance / (16.0 * self.contact_radius**3)

    def traction(self, r: ArrayLike) -> FloatArray:
        """Circumferential traction in Pa; infinite at the edge, 0 outside."""
        r, a = np.asarray(r, float), self.contact_radius
        root = np.sqrt(np.maximum(a - r, 0.0) * (a + r))
        scale = 3.0 * self.moment / (4.0 * np.pi * a**3)
        inside: FloatArray = np.divide(scale * r, root, out=np.zeros_like(r), where=root > 0.0)
        return np.where((r == a) & (self.moment != 0.0), np.copysign(np.inf, self.moment), inside)

    def displacement(self, r: ArrayLike) -> FloatArray:
        """Circumferential displacement in m on the whole surface."""
        r = np.asarray(r, float)
        turned: FloatArray = x_minus_sin(polar_angle(r, self.contact_radius)) / np.pi
        displacement: FloatArray = self.twist * r * turned
        return displacement


@dataclass(frozen=True, slots=True)
class TorsionPartialSlip:
    """Hertz ``contact`` with ``friction`` μ > 0 under ``moment`` M in N·m, 0 ≤ M ≤ 3πμF_N a/16.

    ``annulus`` is (a − c)/a and ``stick_share`` c/a, each to full relative precision, towards no load and towards full
    slip. There the twist is infinite: it grows with the logarithm of a/c. Raises ``InvalidInput`` for M beyond.
    """

    contact: HertzContact
    friction: float
    moment: float
    annulus: float = field(init=False)
    stick_share: float = field(init=False)

    def __post_init__(self) -> None:
        check_range("friction", self.friction, above=0.0)
        check_range("normal_force", self.contact.normal_force, above=0.0, unit="N")
        limit = sliding_moment(self.contact, self.friction)
        check_range("moment", self.moment, at_least=0.0, at_most=limit, unit="N m")
        annulus, share = _split_radius(self.moment / limit, (limit - self.moment) / limit)
        object.__setattr__(self, "annulus", annulus)
        object.__setattr__(self, "stick_share", share)

    @property
    def stick_radius(self) -> float:
        """Radius c of the sticking circle, in m."""
        return self.contact.contact_radius * self.stick_share

    @property
    def stick_ratio(self) -> float:
        """Stick area over contact area."""
        return self.stick_share**2

    @property
    def twist(self) -> float:
        """Angle between the bodies in rad, (μp₀/2G) ∫ E/s ds from c to a."""
        if self.stick_share == 0.0:
            return np.inf
        s = self.stick_share + self.annulus * NODES
        rest = self.annulus * float(np.dot((_elliptic(s) - 1.0) / s, WEIGHTS))
        return self._strain * (float(self._logarithm(np.array(1.0))) + rest)

    def traction(self, r: ArrayLike) -> FloatArray:
        """Circumferential traction in Pa: μp in slip, 0 outside the contact.

        In stick the sum over s is (2/π) μp₀ ∫ E(1 − s²/a²) dφ with s = r/sin φ, from asin(r/a) to asin(r/c).
        """
        r = np.asarray(r, float)
        limit = self.friction * self.contact.pressure(r)
        if self.stick_share == 0.0:
            return limit
        c, share = self.stick_share, np.minimum(r / self.contact.contact_radius, self.stick_share)
        at_a, at_c = np.sqrt((1.0 - share) * (1.0 + share)), np.sqrt((c - share) * (c + share))
        sine = (
            share / c * self.annulus * (1.0 + c) / (at_a + at_c + (at_a == 0.0))
        )  # without slip both are 0 at the edge
        span = np.arctan2(sine, (at_a * at_c + share**2) / c)
        phi = np.arctan2(share, at_a)[..., np.newaxis] + span[..., np.newaxis] * NODES
        s = np.divide(share[..., np.newaxis], np.sin(phi), out=np.ones_like(phi), where=phi > 0.0)
        stuck = 2.0 / np.pi * self.friction * self.contact.peak_pressure * span * (_elliptic(s) @ WEIGHTS)
        return np.where(r < self.stick_radius, stuck, limit)

    def slip(self, r: ArrayLike) -> FloatArray:
        """Slip of the first body relative to the second, in m, along the moment: ≤ 0; 0 in stick, NaN outside.

        The state of radius s < r turns the circle r by less than dΦ; with v² = ln(r/s) the sum over s has no root.
        Minus infinity once the whole contact slips, except on the axis.
        """
        r, a = np.asarray(r, float), self.contact.contact_radius
        if self.stick_share == 0.0:
            return np.where(r > a, np.nan, np.where(r > 0.0, -np.inf, 0.0))
        share = np.minimum(r / a, 1.0)
        span = np.sqrt(self._logarithm(share))[..., np.newaxis]
        v_square = (span * NODES) ** 2
        chi = 2.0 * np.arctan2(np.sqrt(-np.expm1(-2.0 * v_square)), np.exp(-v_square))
        s = share[..., np.newaxis] * np.exp(-v_square)
        total = (_elliptic(s) * (chi + np.sin(chi)) * 2.0 * np.sqrt(v_square)) @ WEIGHTS * span[..., 0]
        slip = -self._strain / np.pi * a * share * total
        return np.where(r > a, np.nan, slip)

    def displacement(self, r: ArrayLike) -> FloatArray:
        """Circumferential displacement of the first body less that of the second, in m, on the whole surface.

        Infinite in contact once all of it slips.
        """
        r, a = np.asarray(r, float), self.contact.contact_radius
        inside = r <= a
        displacement = np.empty_like(r)
        displacement[inside] = self._turned(r[inside])
        displacement[~inside] = self._far_displacement(r[~inside] / a)
        return displacement

    @property
    def _strain(self) -> float:
        return 0.5 * self.friction * self.contact.peak_pressure * self.contact.compliance.shear

    def _turned(self, r: FloatArray) -> FloatArray:
        if self.stick_share == 0.0:
            return np.where(r > 0.0, np.inf, 0.0)
        return self.twist * r + self.slip(r)

    def _logarithm(self, share: FloatArray) -> FloatArray:
        """Logarithm of r/c, 0 in stick; from the annulus where that is thin."""
        outside_stick = self.annulus - (1.0 - share) if self.annulus < 0.5 else share - self.stick_share
        logarithm: FloatArray = np.log1p(np.maximum(outside_stick, 0.0) / self.stick_share)
        return logarithm

    def _far_displacement(self, share: FloatArray) -> FloatArray:
        """Sum over s outside the contact, in ψ = 2 asin(s/r)."""
        c = self.stick_share
        beyond_a, beyond_c = np.sqrt((share - 1.0) * (share + 1.0)), np.sqrt((share - c) * (share + c))
        sine = self.annulus * (1.0 + c) / (beyond_c + c * beyond_a)
        span = 2.0 * np.arctan2(sine, (beyond_a * beyond_c + c) / share**2)[..., np.newaxis]
        psi = 2.0 * np.arctan2(c, beyond_c)[..., np.newaxis] + span * NODES
        s = share[..., np.newaxis] * np.sin(0.5 * psi)
        total = (_elliptic(s) * x_minus_sin(psi) / np.tan(0.5 * psi)) @ WEIGHTS * 0.5 * span[..., 0]
        return self._strain / np.pi * self.contact.contact_radius * share * total


def sliding_moment(contact: HertzContact, friction: float) -> float:
    """Moment in N·m at which the whole contact slips, 3πμF_N a/16."""
    return 3.0 * np.pi / 16.0 * friction * contact.normal_force * contact.contact_radius


def _elliptic(s: FloatArray) -> FloatArray:
    """Complete elliptic integral E of parameter 1 − s², for s in [0, 1]."""
    result: FloatArray = special.ellipe(np.maximum((1.0 - s) * (1.0 + s), 0.0))
    return result


def _split_radius(ratio: float, remainder: float) -> tuple[float, float]:
    """Shares (1 − c/a, c/a) for a moment ``ratio`` = 1 − ``remainder`` of that of full slip, solved for the smaller."""
    if ratio == 0.0 or remainder == 0.0:
        return (0.0, 1.0) if ratio == 0.0 else (1.0, 0.0)
    if ratio < 0.5:
        least = 2.0 / np.pi * FULL_SLIP * ratio  # E is at most π/2, and the annulus below 0.25 up to half the moment
        annulus = _root(lambda width: _moment(1.0 - width, width), FULL_SLIP * ratio, least, 0.25)
        return annulus, 1.0 - annulus
    bounds = np.cbrt(np.array([6.0 / np.pi, 3.0]) * FULL_SLIP * remainder)  # E lies between 1 and π/2
    share = _root(lambda radius: _moment(0.0, radius), FULL_SLIP * remainder, float(bounds[0]), float(bounds[1]))
    return 1.0 - share, share


def _moment(start: float, width: float) -> float:
    """Integral of s² E(1 − s²) from ``start`` over ``width``."""
    s = start + width * NODES
    return width * float(np.dot(s * s * _elliptic(s), WEIGHTS))


def _root(function: Callable[[float], float], value: float, low: float, high: float) -> float:
    """Argument at which ``function``, which grows, has ``value``: to rounding, relative to the argument."""
    low, high = low * (1.0 - 1e-12), min(high * (1.0 + 1e-12), 1.0)
    root = optimize.brentq(lambda x: function(x) - value, low, high, xtol=1e-300, rtol=1e-15)
    return float(root)
