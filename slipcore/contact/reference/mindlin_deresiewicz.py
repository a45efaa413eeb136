"""Mindlin–Deresiewicz: tangential force that unloads, reverses or changes together with the normal force.

Any axisymmetric tangential traction of a Hertz contact is a sum of the pressures p_η that the contact had at normal
forces η ≤ F_N: q(r) = ∫ D(η) dp_η with |D| ≤ μ, and F_T = ∫ D dη. The function D is the contact's whole memory. A rise
of F_N with |dF_T| ≤ μ dF_N adds to its end; all else makes D = ±μ from the end downwards until F_T fits. Unloading,
reversal loops, and F_N then F_T raised together (q_old + μ(p₂ − p_c')) are cases of this one rule.

Source: Mindlin & Deresiewicz, J. Appl. Mech. 20 (1953) 327; as a rule on D: Jäger, Arch. Appl. Mech. 68 (1998) 91, and
Aleshin, Bou Matar & Van Den Abeele, Int. J. Solids Struct. 59 (2015) 44. Poisson terms as in ``cattaneo_mindlin``.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from slipcore.contact.reference.cattaneo_mindlin import CattaneoMindlin
from slipcore.contact.reference.checks import check_range
from slipcore.contact.reference.elastic_pair import Compliance
from slipcore.contact.reference.ellipsoidal import deviator_over_square, potential, tangential_displacement
from slipcore.contact.reference.hertz import HertzContact
from slipcore.frames import FloatArray


@dataclass(frozen=True, slots=True)
class MindlinDeresiewicz:
    """Tangential state of a Hertz ``contact`` with ``friction`` μ > 0, after any path of loads along ±x.

    A new one has no tangential load; ``load`` gives the state at the end of a straight path to other loads. Its memory:
    ``memory`` D on the intervals between ``levels`` of the normal force, 0 = η₀ < … < F_N. ``stick_level``: the normal
    force at which the contact had the size that stuck during the last path. Raises ``InvalidInput`` for |F_T| > μF_N.
    """

    contact: HertzContact
    friction: float
    levels: tuple[float, ...] = ()
    memory: tuple[float, ...] = ()
    stick_level: float = np.inf

    def __post_init__(self) -> None:
        check_range("friction", self.friction, above=0.0)
        if not self.levels:
            force = self.contact.normal_force
            object.__setattr__(self, "levels", (0.0, force) if force > 0.0 else (0.0,))
            object.__setattr__(self, "memory", (0.0,) if force > 0.0 else ())

    @property
    def tangential_force(self) -> float:
        """Tangential force on the first body along +x, in N."""
        return float(np.dot(self.memory, np.diff(self.levels)))

    @property
    def stick_radius(self) -> float:
        """Radius inside which nothing slipped during the last path of loads, in m."""
        return self._at(min(self.stick_level, self.contact.normal_force)).contact_radius

    @property
    def rigid_displacement(self) -> float:
        """Displacement of the bodies relative to one another along +x, in m, as long as the centre has always stuck.

        After sliding of the whole contact it counts from where the centre stuck again.
        """
        compliance = self.contact.compliance
        squares = np.diff([self._at(level).contact_radius ** 2 for level in self.levels])
        slope = self.contact.pressure_slope * (compliance.shear - 0.5 * compliance.poisson)
        return float(np.pi / 4.0 * slope * np.dot(self.memory, squares))

    def load(self, normal_force: float, tangential_force: float) -> "MindlinDeresiewicz":
        """State after a straight path of (F_N, F_T) to these loads, in N."""
        limit = self.friction * check_range("normal_force", normal_force, at_least=0.0, unit="N")
        check_range("tangential_force", tangential_force, at_least=-limit, at_most=limit, unit="N")
        levels, memory = _cut(self.levels, self.memory, normal_force)
        rise = normal_force - levels[-1]
        excess = tangential_force - float(np.dot(memory, np.diff(levels)))
        stick_level = normal_force
        if rise > 0.0 and abs(excess) <= self.friction * rise:
            levels, memory = (*levels, normal_force), (*memory, excess / rise)
        elif excess != 0.0:
            limit = float(np.copysign(self.friction, excess))
            stick_level = _slip_front(levels, memory, normal_force, tangential_force, limit)
            levels, memory = _cut(levels, memory, stick_level)
            levels, memory = (*levels, normal_force), (*memory, limit)
        return replace(self, contact=self._at(normal_force), levels=levels, memory=memory, stick_level=stick_level)

    def traction(self, r: ArrayLike) -> FloatArray:
        """Traction along +x on the first body, in Pa, at r (m) from the axis."""
        r = np.asarray(r, float)
        parts = [d * (high.pressure(r) - low.pressure(r)) for d, low, high in self._shells()]
        return np.sum(parts, axis=0) if parts else np.zeros_like(r)

    def displacement(self, x: ArrayLike, y: ArrayLike, body: Compliance | None = None) -> FloatArray:
        """Surface displacement (u_x, u_y) [..., 2] of ``body``, by default of both (first minus second), in m."""
        x, y = np.broadcast_arrays(np.asarray(x, float), np.asarray(y, float))
        r, compliance, slope = np.hypot(x, y), body or self.contact.compliance, self.contact.pressure_slope
        axial, deviator = np.zeros_like(r), np.zeros_like(r)
        for d, low, high in self._shells():
            axial += d * (potential(r, high.contact_radius) - potential(r, low.contact_radius))
            deviator += d * (deviator_over_square(r, high.contact_radius) - deviator_over_square(r, low.contact_radius))
        return slope * tangential_displacement(x, y, axial, deviator, compliance.shear, compliance.poisson)

    def _at(self, normal_force: float) -> HertzContact:
        return replace(self.contact, normal_force=normal_force)

    def _shells(self) -> list[tuple[float, HertzContact, HertzContact]]:
        sizes = [self._at(level) for level in self.levels]
        shells = zip(self.memory, sizes[:-1], sizes[1:], strict=True)
        return [shell for shell in shells if shell[0] != 0.0]


def cycle_dissipation(contact: HertzContact, friction: float, amplitude: float) -> float:
    """Energy in J lost in one cycle of F_T between ±``amplitude`` N at constant F_N (Johnson, eq. 7.61).

    In terms of t = (1 − F_T/μF_N)^⅓ the bracket of the book is (1 − t)³(1 + 3t + t²)/6, which doesn't cancel: the loss
    falls with the cube of the amplitude.
    """
    case = CattaneoMindlin(contact, friction, amplitude)
    if amplitude == 0.0:
        return 0.0
    t = float(np.cbrt(1.0 - case.load_ratio))
    bracket = (case.load_ratio / (1.0 + t + t * t)) ** 3 * (1.0 + 3.0 * t + t * t) / 6.0
    compliance = 2.0 * contact.compliance.shear - contact.compliance.poisson
    return 0.9 * (friction * contact.normal_force) ** 2 / contact.contact_radius * compliance * bracket


def _cut(
    levels: tuple[float, ...], memory: tuple[float, ...], top: float
) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Memory below the level ``top``; what lies above it is forgotten."""
    kept = [level for level in levels if level < top]
    if not kept:
        return (0.0,), ()
    if len(kept) == len(levels):
        return levels, memory
    return (*kept, top), memory[: len(kept)]


def _slip_front(
    levels: tuple[float, ...], memory: tuple[float, ...], normal_force: float, tangential_force: float, limit: float
) -> float:
    """Level η* with ∫₀^η* D dη + limit (F_N − η*) = F_T: below it the memory stays, above it the contact slips."""
    missing = tangential_force - limit * normal_force  # of ∫₀^η (D − limit) dη: it falls from 0 where limit > 0
    held = 0.0
    for low, high, d in zip(levels[:-1], levels[1:], memory, strict=True):
        step = (d - limit) * (high - low)
        if abs(held + step) >= abs(missing) and d != limit:
            return low + min(max((missing - held) / (d - limit), 0.0), high - low)
        held += step
    return levels[-1]
