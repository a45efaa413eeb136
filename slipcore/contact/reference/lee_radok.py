"""Lee–Radok: a rigid sphere pressed into a viscoelastic half-space whose relaxation is a Prony series.

Holds while the contact grows, which a force that never falls guarantees. Poisson's ratio is constant in time, so one
relaxation function E*(t) carries the material. Source: Lee & Radok, J. Appl. Mech. 27 (1960) 438; Johnson, Contact
Mechanics (1985), §6.5.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike
from scipy import optimize

from slipcore.contact.defaults import REFERENCE
from slipcore.contact.reference.checks import check_range
from slipcore.errors import InvalidInput
from slipcore.frames import FloatArray

NODES, WEIGHTS = np.polynomial.legendre.leggauss(REFERENCE.line_nodes)
NODES, WEIGHTS = (0.5 * (NODES + 1.0)) ** 2, 0.5 * (NODES + 1.0) * WEIGHTS
"""Gauss–Legendre on [0, 1], graded towards 0, where a point's pressure starts with the root of time."""


@dataclass(frozen=True, slots=True, eq=False)
class PronySeries:
    """Relaxation E*(t) = E_∞ + Σ E_k exp(−t/τ_k).

    ``equilibrium`` E_∞ ≥ 0 and ``moduli`` E_k > 0 in Pa, ``times`` τ_k > 0 in s. Raises ``InvalidInput``.
    """

    equilibrium: float
    moduli: tuple[float, ...] = ()
    times: tuple[float, ...] = ()
    rates: FloatArray = field(init=False)
    weights: FloatArray = field(init=False)

    def __post_init__(self) -> None:
        check_range("equilibrium", self.equilibrium, at_least=0.0, unit="Pa")
        if len(self.moduli) != len(self.times):
            raise InvalidInput("times", f"{len(self.times)} of them", f"as many as moduli, {len(self.moduli)}")
        for modulus, time in zip(self.moduli, self.times, strict=True):
            check_range("moduli", modulus, above=0.0, unit="Pa")
            check_range("times", time, above=0.0, unit="s")
        check_range("instantaneous modulus", self.instantaneous, above=0.0, unit="Pa")
        rates, weights = self._retardation()
        object.__setattr__(self, "rates", rates)
        object.__setattr__(self, "weights", weights)

    @property
    def instantaneous(self) -> float:
        """Modulus E*(0) in Pa."""
        return self.equilibrium + sum(self.moduli)

    def relaxation(self, time: ArrayLike) -> FloatArray:
        """Modulus E*(t) in Pa at t ≥ 0."""
        t = np.asarray(time, float)[..., np.newaxis]
        modulus: FloatArray = self.equilibrium + np.exp(-t / np.array(self.times)) @ np.array(self.moduli)
        return modulus

    def creep(self, time: ArrayLike) -> FloatArray:
        """Compliance J(t) in 1/Pa at t ≥ 0, the exact inverse of the relaxation: ∫ E*(t − τ) dJ(τ) = 1."""
        t = np.asarray(time, float)[..., np.newaxis]
        compliance: FloatArray = 1.0 / self.instantaneous + (t * _phi_1(self.rates * t)) @ self.weights
        return compliance

    def creep_integral(self, time: ArrayLike) -> FloatArray:
        """Integral of the creep compliance from 0 to t, in s/Pa; 0 before."""
        t = np.maximum(np.asarray(time, float), 0.0)[..., np.newaxis]
        integral: FloatArray = t[..., 0] / self.instantaneous + (t**2 * _phi_2(self.rates * t)) @ self.weights
        return integral

    def _retardation(self) -> tuple[FloatArray, FloatArray]:
        """Retardation rates in 1/s and weights: the eigenvalues of a symmetric matrix, hence never complex."""
        moduli, times = np.array(self.moduli), np.array(self.times)
        v = np.sqrt(moduli / times)
        rates, vectors = np.linalg.eigh(np.diag(1.0 / times) - np.outer(v, v) / self.instantaneous)
        return np.maximum(rates, 0.0), (v @ vectors / self.instantaneous) ** 2


@dataclass(frozen=True, slots=True, eq=False)
class LeeRadok:
    """Sphere of ``sphere_radius`` m under ``force`` [k] N, linear between ``time`` [k] s, on ``material``.

    ``force[0]`` ≥ 0 is applied at once, and the last one stays. Raises ``InvalidInput`` where the force falls, since
    the contact would then shrink.
    """

    sphere_radius: float
    material: PronySeries
    time: FloatArray
    force: FloatArray

    def __post_init__(self) -> None:
        check_range("sphere_radius", self.sphere_radius, above=0.0, unit="m")
        time, force = np.array(self.time, float), np.array(self.force, float)
        if time.ndim != 1 or time.shape != force.shape or len(time) == 0:
            raise InvalidInput("force", f"of shape {list(force.shape)}", "one a time, at least one")
        if not (np.isfinite(time).all() and (np.diff(time) > 0.0).all()):
            raise InvalidInput("time", "not increasing", "strictly increasing seconds")
        check_range("force", float(force[0]), at_least=0.0, unit="N")
        if not (np.isfinite(force).all() and (np.diff(force) >= 0.0).all()):
            raise InvalidInput("force", "falling or not finite", "forces in N that never fall")
        object.__setattr__(self, "time", time)
        object.__setattr__(self, "force", force)

    def contact_radius(self, time: ArrayLike) -> FloatArray:
        """Contact radius a in m: a³ = ¾R ∫ J(t − τ) dF(τ); 0 before the first force."""
        t = np.asarray(time, float)
        later = t - self.time[0]
        cube = np.where(later >= 0.0, self.force[0] * self.material.creep(np.maximum(later, 0.0)), 0.0)
        slopes = np.diff(self.force) / np.diff(self.time)
        for slope, start, end in zip(slopes, self.time[:-1], self.time[1:], strict=True):
            cube = cube + slope * (self.material.creep_integral(t - start) - self.material.creep_integral(t - end))
        radius: FloatArray = np.cbrt(0.75 * self.sphere_radius * cube)
        return radius

    def approach(self, time: ArrayLike) -> FloatArray:
        """Indentation a²/R in m."""
        approach: FloatArray = self.contact_radius(time) ** 2 / self.sphere_radius
        return approach

    def pressure(self, r: ArrayLike, time: float) -> FloatArray:
        """Pressure in Pa at r (m) from the axis at one time: (2/πR) ∫ E*(t − τ) d√(a²(τ) − r²)."""
        at = np.vectorize(lambda radius: self._pressure(float(radius), time), otypes=[float])
        return np.asarray(at(np.asarray(r, float)))

    def _pressure(self, r: float, time: float) -> float:
        """The integral by parts, E*(0) w(t) − Σ (E_k/τ_k) ∫ exp((τ − t)/τ_k) w dτ with w = √(a² − r²)."""
        if float(self.contact_radius(time)) <= r:
            return 0.0
        moduli, times = np.array(self.material.moduli), np.array(self.material.times)
        edges = self._panels(self._touch(r, time), time)
        tau = edges[:-1, None] + np.diff(edges)[:, None] * NODES
        fading = np.exp((tau[..., None] - time) / times) @ (moduli / times)
        lost = float((np.diff(edges)[:, None] * WEIGHTS * fading * self._root(r, tau)).sum())
        held = self.material.instantaneous * float(self._root(r, np.array(time)))
        return 2.0 / (np.pi * self.sphere_radius) * (held - lost)

    def _root(self, r: float, time: FloatArray) -> FloatArray:
        a = self.contact_radius(time)
        root: FloatArray = np.sqrt(np.maximum(a - r, 0.0) * (a + r))
        return root

    def _touch(self, r: float, time: float) -> float:
        """Time at which the contact reaches r."""
        start = float(self.time[0])
        if float(self.contact_radius(start)) >= r:
            return start
        return float(optimize.brentq(lambda t: float(self.contact_radius(t)) - r, start, time, xtol=1e-300, rtol=1e-15))

    def _panels(self, start: float, end: float) -> FloatArray:
        """Edges of panels on which the integrand is smooth: kinks of the force, and the layers of fading memory."""
        layers = [end - multiple * tau for tau in self.material.times for multiple in (1.0, 4.0, 16.0)]
        inner = [edge for edge in (*self.time, *layers) if start < edge < end]
        return np.unique(np.array([start, *inner, end]))


def _phi_1(x: FloatArray) -> FloatArray:
    """Value of (1 − e^{−x})/x."""
    quotient: FloatArray = np.divide(-np.expm1(-x), x, out=np.ones_like(x), where=x > 0.0)
    return quotient


def _phi_2(x: FloatArray) -> FloatArray:
    """Value of (x − 1 + e^{−x})/x², summed where the difference would cancel."""
    series = np.ones_like(x)
    for k in range(18, 2, -1):  # ½(1 − x/3 (1 − x/4 (…))): the rest is below 1e-17 at x = 1
        series = 1.0 - np.minimum(x, 1.0) / k * series
    direct = np.divide(x + np.expm1(-x), x * x, out=np.ones_like(x), where=x > 1.0)
    return np.where(x > 1.0, direct, 0.5 * series)
