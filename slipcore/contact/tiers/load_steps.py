"""Load steps of a simulation: where they end between two frames.

In no step an edge goes too far: that of the contact, where the finger is pressed down while its surface moves sideways,
and that of stick, where a load comes closer to sliding. Cells then touch, and begin to slip, ring after ring.

Stick has the edge of the contact under the normal force that friction does not need, F_N − F_T/μ (Cattaneo, Mindlin;
of any shape Jäger, Ciavarella), and after a load has turned back, under F_N − ΔF_T/2μ, ΔF_T its change since then.
Radii are taken to be Hertz's, a ∝ F^⅓, and μ to be that of the whole contact; steps for other shapes and friction are
as fine, but not quite as even.
"""

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from slipcore.contact.defaults import TINY
from slipcore.contact.plan.plan import LOADS, MOTIONS, Plan
from slipcore.contact.tiers.probe import ContactProbe
from slipcore.frames import FloatArray


class Edge(NamedTuple):
    """How far an edge moves in some time, as a share of the contact's largest width, and the normal forces N under
    which a contact has it at the begin and at the end; that of the contact itself counts on both sides.
    """

    moved: float
    before: float
    now: float


class LoadSteps:
    """The load steps of a plan whose contact is known."""

    def __init__(self, plan: Plan, contact: ContactProbe) -> None:
        self._plan, self._corners, self._largest = plan, plan.corners(), plan.largest_force()
        self._friction, self._lever = max(contact.friction, TINY), contact.lever or 1.0  # any, without friction
        self._turned, self._turns = self._turning_points()

    def between(self, begin: float, end: float, substeps: int, growth: float) -> FloatArray:
        """Times s from ``begin`` to ``end``, both included, between which a load step goes.

        They divide the time in ``substeps`` equal parts and where a load bends, and each of these into steps in which
        an edge moves by the same. In none the contact becomes wider by more than ``growth``, as a share of its largest
        width, or the edge of stick moves by more than that.
        """
        bends = self._corners[(self._corners > begin) & (self._corners < end)]
        instants = np.union1d(np.linspace(begin, end, substeps + 1), bends)
        parts = [self._parts(float(before), float(now), growth) for before, now in pairwise(instants)]
        return np.concatenate((instants[:1], *parts))

    def growths(self, instants: FloatArray) -> FloatArray:
        """By how much the contact becomes wider, or the edge of stick moves, between instants and bends, as shares of
        the largest width: what the number of load steps follows from, whatever their growth may be.
        """
        ends = np.union1d(instants, self._corners[self._corners < instants[-1]])
        return np.array([self._edge(float(begin), float(end)).moved for begin, end in pairwise(ends)])

    def _parts(self, begin: float, end: float, growth: float) -> FloatArray:
        """Ends of the steps between two times between which loads are linear."""
        moved, before, now = self._edge(begin, end)
        if moved == 0.0:
            return np.array([end])
        forces = np.linspace(np.cbrt(before), np.cbrt(now), int(np.ceil(moved / growth)) + 1)[1:-1] ** 3
        return np.append(begin + (end - begin) * (forces - before) / (now - before), end)

    def _edge(self, begin: float, end: float) -> Edge:
        """The edge that moves farthest between two times."""
        before, now = (max(self._plan.value("normal_force", time), 0.0) for time in (begin, end))
        widens = now > before and self._moves_sideways(begin, end)
        edges = [Edge(2.0 * self._move(before, now), before, now) if widens else Edge(0.0, before, now)]
        turn = self._turns[int(np.searchsorted(self._turned, begin, side="right")) - 1]
        for since, share in ((np.zeros_like(turn), 1.0), (turn, 0.5)):
            first, last = (share * float(np.linalg.norm(self._load(time) - since)) for time in (begin, end))
            spare, left = max(before - first / self._friction, 0.0), max(now - last / self._friction, 0.0)
            if left < spare and (first > 0.0 or last > 0.0):
                edges.append(Edge(self._move(left, spare), spare, left))
        return max(edges)

    def _move(self, smaller: float, larger: float) -> float:
        """How far apart the edges of contacts under two normal forces are, as a share of the largest width."""
        return 0.5 * float(np.cbrt(larger / self._largest) - np.cbrt(smaller / self._largest))

    def _load(self, time: float) -> FloatArray:
        """Forces along the surface, and the moment as one that is as close to sliding, [3] N."""
        return np.array([self._plan.value(channel, time) for channel in LOADS]) / (1.0, 1.0, self._lever)

    def _turning_points(self) -> tuple[list[float], list[FloatArray]]:
        """Times s at which the load along the surface turns back, and its values [3] N there; the begin is one."""
        times = [0.0, *map(float, self._corners), self._plan.duration]
        at, loads, before = [0.0], [self._load(0.0)], np.zeros(3)
        for begin, end in pairwise(times):
            change = self._load(end) - self._load(begin)
            if change @ before < 0.0:
                at.append(begin)
                loads.append(self._load(begin))
            before = change if change.any() else before
        return at, loads

    def _moves_sideways(self, begin: float, end: float) -> bool:
        """Whether the surface moves sideways while it is pressed."""
        if self._plan.problem.coupled or self._plan.problem.spread:
            return True
        return any(self._plan.value(channel, begin) != self._plan.value(channel, end) for channel in (*LOADS, *MOTIONS))
