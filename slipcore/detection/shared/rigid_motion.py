"""Weighted rigid motion in the plane, and where it carries a point."""

import math
from typing import NamedTuple

import numpy as np

from slipcore.compilation import compiled
from slipcore.frames import FloatArray

EPSILON = float(np.finfo(float).eps)


class RigidMotion(NamedTuple):
    """A finite motion in the plane: turn by ``rotation`` rad about (x, y) m and carry by (dx, dy) m.

    All NaN where the motion is unobservable.
    """

    x: float
    y: float
    dx: float
    dy: float
    rotation: float

    def displacement(self, points: FloatArray) -> FloatArray:
        """How far the motion carries points [..., 2] m: [..., 2] m; exact for finite rotation.

        cos φ − 1 is taken as −2 sin²(φ/2), so that a tiny motion of far points keeps its digits.
        """
        sine, versine = math.sin(self.rotation), 2.0 * math.sin(0.5 * self.rotation) ** 2
        x, y = points[..., 0] - self.x, points[..., 1] - self.y
        moved = np.empty_like(points)
        moved[..., 0] = self.dx - versine * x - sine * y
        moved[..., 1] = self.dy + sine * x - versine * y
        return moved

    @property
    def observable(self) -> bool:
        """Whether the motion is known."""
        return math.isfinite(self.rotation)


@compiled
def fit_motion(position: FloatArray, start: FloatArray, end: FloatArray, weight: FloatArray) -> RigidMotion:
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
        return RigidMotion(math.nan, math.nan, math.nan, math.nan, math.nan)
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
        return RigidMotion(math.nan, math.nan, math.nan, math.nan, math.nan)
    return RigidMotion(x, y, u, v, math.atan2(across, spread + along))


def fit_rigid_motion(points: FloatArray, moved: FloatArray, weight: FloatArray | None = None) -> RigidMotion:
    """The rigid motion that best explains displacements ``moved`` [k, 2] m of ``points`` [k, 2] m.

    Weighted least squares in closed form (planar Procrustes problem), exact for finite rotation. ``weight`` [k] ≥ 0.
    Fewer than two distinct points of positive weight leave it unobservable.
    """
    start, moved = np.zeros((1, *points.shape)), np.ascontiguousarray(moved)[None]
    w = np.ones(len(points)) if weight is None else weight
    return fit_motion(np.ascontiguousarray(points)[None], start, moved, np.ascontiguousarray(w)[None])
