"""Weighted rigid motion in the plane, and where it carries a point."""

import math
from typing import NamedTuple

import numpy as np

from slipcore.frames import FloatArray
from slipcore.kernels import compiled

EPSILON = float(np.finfo(float).eps)


class Motion(NamedTuple):
    """Turn by ``rotation`` rad about (x, y) m and carry by (dx, dy) m; all NaN where the motion is unobservable."""

    x: float
    y: float
    dx: float
    dy: float
    rotation: float


@compiled
def fit_motion(position: FloatArray, start: FloatArray, end: FloatArray, weight: FloatArray) -> Motion:
    """The rigid motion that best explains how points went from displacement ``start`` to ``end`` of their ``position``.

    All [n, m, 2 or more] m; ``weight`` [n, m] ≥ 0. Weighted least squares in closed form (planar Procrustes problem).
    All NaN where fewer than two distinct points have weight.
    """
    n, m = weight.shape
    total = x = y = u = v = size = 0.0
    for i in range(n):
        for j in range(m):
            w = weight[i, j]
            if w == 0.0:
                continue
            px, py = position[i, j, 0] + start[i, j, 0], position[i, j, 1] + start[i, j, 1]
            total += w
            x += w * px
            y += w * py
            u += w * (end[i, j, 0] - start[i, j, 0])
            v += w * (end[i, j, 1] - start[i, j, 1])
            size = max(size, abs(px), abs(py))
    if not total > 0.0:
        return Motion(math.nan, math.nan, math.nan, math.nan, math.nan)
    x, y, u, v = x / total, y / total, u / total, v / total
    spread = across = along = 0.0
    for i in range(n):
        for j in range(m):
            w = weight[i, j]
            if w == 0.0:
                continue
            rx, ry = position[i, j, 0] + start[i, j, 0] - x, position[i, j, 1] + start[i, j, 1] - y
            du, dv = end[i, j, 0] - start[i, j, 0] - u, end[i, j, 1] - start[i, j, 1] - v
            spread += w * (rx * rx + ry * ry)
            across += w * (rx * dv - ry * du)
            along += w * (rx * du + ry * dv)
    if not spread > (EPSILON * size) ** 2 * total:
        return Motion(math.nan, math.nan, math.nan, math.nan, math.nan)
    return Motion(x, y, u, v, math.atan2(across, spread + along))
