"""The loads that friction can carry: the limit surface of a contact (Goyal, Ruina, Papadopoulos 1991).

A load (F_x, F_y, M) can be carried if and only if no rigid sliding motion would let it do more work than friction
everywhere takes up: load·d ≤ σ(d) = Σ R_i |B_i d| for every d.
"""

from typing import NamedTuple

import numpy as np

from slipcore.compilation import compiled
from slipcore.frames import BoolArray, FloatArray


class LimitLoad(NamedTuple):
    """``factor`` by which a load may grow until all slides, and the ``motion`` [3] (direction) of that sliding."""

    factor: float
    motion: FloatArray


class Descent(NamedTuple):
    """When the search ends: after so many ``descents``, or by less than ``settled`` as a share. ``still``: share of the
    fastest motion under which a point counts as its centre; ``rank``: least singular value of the friction matrix, as a
    share of the largest; ``free_motion``: share of a load that may be missed before a motion meets no friction.
    """

    descents: int
    settled: float
    still: float
    rank: float
    free_motion: float


@compiled
def find_limit_load(
    radius: FloatArray, arm: FloatArray, load: FloatArray, given: BoolArray, descent: Descent
) -> LimitLoad:
    """How far ``load`` [3] is from the limit surface of disks of ``radius`` [n] at ``arm`` [2, n].

    Where a component's motion is held instead of its load, it takes part in no sliding. The factor is infinite
    without load. Minimises σ(d) subject to load·d = 1 by iteratively reweighted least squares, which only descends.
    """
    load = np.where(given, load, 0.0)
    if not load.any():
        return LimitLoad(np.inf, np.zeros(3))
    factor, motion, free = np.inf, load / (load @ load), np.outer(given, given)
    for _ in range(descent.descents):
        taken, matrix = _friction(radius, arm, motion, descent.still)
        if taken >= factor * (1.0 - descent.settled):
            break
        factor, matrix = taken, matrix * free
        solution = np.linalg.pinv(matrix, descent.rank) @ load
        if np.abs(matrix @ solution - load).max() > descent.free_motion * np.abs(load).max():
            return LimitLoad(0.0, motion)  # some motion meets no friction, such as rotation about a single cell
        motion = solution / (load @ solution)
    return LimitLoad(factor, motion)


@compiled
def _friction(radius: FloatArray, arm: FloatArray, motion: FloatArray, still: float) -> tuple[float, FloatArray]:
    """What friction takes up in a sliding motion, σ, and the matrix A for which motion·A·motion = σ."""
    taken, matrix = 0.0, np.zeros((3, 3))
    slowest = still * np.abs(motion).max()
    for i in range(radius.size):
        x, y = arm[0, i], arm[1, i]
        speed = np.hypot(motion[0] - y * motion[2], motion[1] + x * motion[2])
        taken += radius[i] * speed
        weight = radius[i] / max(speed, slowest)
        matrix[0, 0] += weight
        matrix[0, 2] -= weight * y
        matrix[1, 2] += weight * x
        matrix[2, 2] += weight * (x * x + y * y)
    matrix[1, 1] = matrix[0, 0]
    matrix[2, 0], matrix[2, 1] = matrix[0, 2], matrix[1, 2]
    return taken, matrix
