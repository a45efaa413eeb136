"""The loads that friction can carry: the limit surface of a contact (Goyal, Ruina, Papadopoulos 1991).

A load (F_x, F_y, M) can be carried if and only if no rigid sliding motion would let it do more work than friction
everywhere takes up: load·d ≤ σ(d) = Σ R_i |B_i d| for every d.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from slipcore.contact.fields import rigid_displacement
from slipcore.frames import BoolArray, FloatArray


class LimitLoad(NamedTuple):
    """``factor`` by which a load may grow until all slides, and the ``motion`` [3] (direction) of that sliding."""

    factor: float
    motion: FloatArray


def limit_load(radius: FloatArray, arm: FloatArray, load: FloatArray, given: BoolArray) -> LimitLoad:
    """How far ``load`` [3] is from the limit surface of disks of ``radius`` [n] at ``arm`` [2, n].

    Where a component's motion is held instead of its load, it takes part in no sliding. The factor is infinite
    without load. Minimises σ(d) subject to load·d = 1 by iteratively reweighted least squares, which only descends.
    """
    if not (np.abs(load) * given).any():
        return LimitLoad(np.inf, np.zeros(3))
    free = np.flatnonzero(given)
    factor, motion = _descend(radius, arm, np.ascontiguousarray(load[free]), free)
    whole = np.zeros(3)
    whole[free] = motion
    return LimitLoad(float(factor), whole)


def sliding_traction(radius: FloatArray, arm: FloatArray, motion: FloatArray) -> FloatArray:
    """Tractions [2, n] at the Coulomb limit against a sliding ``motion`` [3] of the finger, that is along the
    object's.
    """
    along = rigid_displacement(arm, motion)
    speed = np.hypot(along[0], along[1])
    return along * (radius / np.where(speed > 0.0, speed, 1.0))


@njit(cache=True)
def _descend(radius, arm, load, free):  # type: ignore[no-untyped-def]
    size = free.size
    motion = load / (load @ load)
    factor = np.inf
    row = np.zeros((2, 3))
    for _ in range(500):
        taken, matrix = 0.0, np.zeros((size, size))
        full = np.zeros(3)
        full[free] = motion
        for i in range(radius.size):
            x, y = arm[0, i], arm[1, i]
            speed = np.hypot(full[0] - y * full[2], full[1] + x * full[2])
            taken += radius[i] * speed
            row[0, 0], row[0, 2], row[1, 1], row[1, 2] = 1.0, -y, 1.0, x
            weight = radius[i] / max(speed, 1e-300)
            for a in range(size):
                for b in range(size):
                    matrix[a, b] += weight * (row[0, free[a]] * row[0, free[b]] + row[1, free[a]] * row[1, free[b]])
        if taken >= factor * (1.0 - 1e-15):
            break
        factor = taken
        answer = np.linalg.solve(matrix, load)
        motion = answer / (load @ answer)
    return factor, motion
