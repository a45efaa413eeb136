"""The loads that friction can carry: the limit surface of a contact (Goyal, Ruina, Papadopoulos 1991).

A load (F_x, F_y, M) can be carried if and only if no rigid sliding motion would let it do more work than friction
everywhere takes up: load·d ≤ σ(d) = Σ R_i |B_i d| for every d.
"""

from typing import NamedTuple

import numpy as np

from slipcore.compilation import compiled
from slipcore.contact.defaults import LIMIT_SURFACE
from slipcore.contact.elasticity.fields import rigid_displacement
from slipcore.frames import BoolArray, FloatArray

_STILL = LIMIT_SURFACE.still


class LimitLoad(NamedTuple):
    """``factor`` by which a load may grow until all slides, and the ``motion`` [3] (direction) of that sliding."""

    factor: float
    motion: FloatArray


def limit_load(radius: FloatArray, arm: FloatArray, load: FloatArray, given: BoolArray) -> LimitLoad:
    """How far ``load`` [3] is from the limit surface of disks of ``radius`` [n] at ``arm`` [2, n].

    Where a component's motion is held instead of its load, it takes part in no sliding. The factor is infinite
    without load. Minimises σ(d) subject to load·d = 1 by iteratively reweighted least squares, which only descends.
    """
    load = np.where(given, load, 0.0)
    if not load.any():
        return LimitLoad(np.inf, np.zeros(3))
    factor, motion = np.inf, load / (load @ load)
    for _ in range(LIMIT_SURFACE.descents):
        taken, matrix = _friction(radius, arm, motion)
        if taken >= factor * (1.0 - LIMIT_SURFACE.settled):
            break
        factor, matrix = taken, matrix * np.outer(given, given)
        solution = np.linalg.pinv(matrix, rcond=LIMIT_SURFACE.rank, hermitian=True) @ load
        if np.abs(matrix @ solution - load).max() > LIMIT_SURFACE.free_motion * np.abs(load).max():
            return LimitLoad(0.0, motion)  # some motion meets no friction, such as rotation about a single cell
        motion = solution / (load @ solution)
    return LimitLoad(factor, motion)


def sliding_traction(radius: FloatArray, arm: FloatArray, motion: FloatArray) -> FloatArray:
    """Tractions [2, n] at the Coulomb limit against a sliding ``motion`` [3] of the finger, that is along the
    object's.
    """
    along = rigid_displacement(arm, motion)
    speed = np.hypot(along[0], along[1])
    return along * (radius / np.where(speed > 0.0, speed, 1.0))


@compiled
def _friction(radius: FloatArray, arm: FloatArray, motion: FloatArray) -> tuple[float, FloatArray]:
    """What friction takes up in a sliding motion, σ, and the matrix A for which motion·A·motion = σ."""
    taken, matrix = 0.0, np.zeros((3, 3))
    still = _STILL * np.abs(motion).max()
    for i in range(radius.size):
        x, y = arm[0, i], arm[1, i]
        speed = np.hypot(motion[0] - y * motion[2], motion[1] + x * motion[2])
        taken += radius[i] * speed
        weight = radius[i] / max(speed, still)
        matrix[0, 0] += weight
        matrix[0, 2] -= weight * y
        matrix[1, 2] += weight * x
        matrix[2, 2] += weight * (x * x + y * y)
    matrix[1, 1] = matrix[0, 0]
    matrix[2, 0], matrix[2, 1] = matrix[0, 2], matrix[1, 2]
    return taken, matrix
