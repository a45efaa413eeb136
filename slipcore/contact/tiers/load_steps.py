"""Load steps of a simulation: where they end between two frames."""

from itertools import pairwise

import numpy as np

from slipcore.contact.plan.plan import LOADS, MOTIONS, Plan
from slipcore.frames import FloatArray


def load_steps(plan: Plan, begin: float, end: float, substeps: int, growth: float) -> FloatArray:
    """Times s from ``begin`` to ``end``, both included, between which a load step goes.

    They divide the time in ``substeps`` equal parts and where a load bends. Where the finger is pressed down while its
    surface moves sideways, no step lets the contact's radius grow by more than ``growth``, as a share of its largest:
    cells then touch ring after ring, the first ones too. Radii are taken to be Hertz's, a ∝ F_N^⅓.
    """
    corners = plan.corners()
    bends = corners[(corners > begin) & (corners < end)]
    instants = np.union1d(np.linspace(begin, end, substeps + 1), bends)
    parts = [_parts(plan, float(before), float(now), growth) for before, now in pairwise(instants)]
    return np.concatenate((instants[:1], *parts))


def growths(plan: Plan, instants: FloatArray) -> FloatArray:
    """By how much the contact's radius grows between instants and bends while its surface moves sideways, as shares of
    its largest; 0 elsewhere: what the number of load steps follows from, whatever their growth may be.
    """
    ends = np.union1d(instants, plan.corners()[plan.corners() < instants[-1]])
    found = []
    for begin, end in pairwise(float(time) for time in ends):
        smaller, larger = _radii(plan, begin, end)
        pressed = larger > smaller and _moves_sideways(plan, begin, end)
        found.append((larger - smaller) / float(np.cbrt(plan.largest_force())) if pressed else 0.0)
    return np.array(found)


def _radii(plan: Plan, begin: float, end: float) -> tuple[float, float]:
    """Radii of the contact at two times, in units of that at 1 N."""
    before, now = (float(np.cbrt(max(plan.value("normal_force", time), 0.0))) for time in (begin, end))
    return before, now


def _parts(plan: Plan, begin: float, end: float, growth: float) -> FloatArray:
    """Ends of the steps between two times between which loads are linear: of equal growth of the radius."""
    before, now = (max(plan.value("normal_force", time), 0.0) for time in (begin, end))
    if now <= before or not _moves_sideways(plan, begin, end):
        return np.array([end])
    smaller, larger = _radii(plan, begin, end)
    count = int(np.ceil((larger - smaller) / (growth * np.cbrt(plan.largest_force()))))
    forces = np.linspace(smaller, larger, count + 1)[1:-1] ** 3
    return np.append(begin + (end - begin) * (forces - before) / (now - before), end)


def _moves_sideways(plan: Plan, begin: float, end: float) -> bool:
    """Whether the surface moves sideways while it is pressed."""
    if plan.problem.coupled or plan.problem.spread:
        return True
    return any(plan.value(channel, begin) != plan.value(channel, end) for channel in (*LOADS, *MOTIONS))
