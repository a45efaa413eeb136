"""Planar rigid motion between frames."""

import math
from typing import NamedTuple

import numpy as np

from slipcore.frames import FloatArray
from slipcore.kernels.rigid_motion import fit_motion


class RigidMotion(NamedTuple):
    """A finite motion in the plane: turn by ``rotation`` rad about ``start`` and carry it by ``translation`` m.

    ``start`` and ``translation`` are (x, y) in m. All NaN where the motion is unobservable.
    """

    start: tuple[float, float]
    translation: tuple[float, float]
    rotation: float

    def displacement(self, points: FloatArray) -> FloatArray:
        """How far the motion carries points [..., 2] m: [..., 2] m; exact for finite rotation.

        cos φ − 1 is taken as −2 sin²(φ/2), so that a tiny motion of far points keeps its digits.
        """
        sine, versine = math.sin(self.rotation), 2.0 * math.sin(0.5 * self.rotation) ** 2
        x, y = points[..., 0] - self.start[0], points[..., 1] - self.start[1]
        moved = np.empty_like(points)
        moved[..., 0] = self.translation[0] - versine * x - sine * y
        moved[..., 1] = self.translation[1] + sine * x - versine * y
        return moved

    @property
    def observable(self) -> bool:
        """Whether the motion is known."""
        return math.isfinite(self.rotation)


def fit_rigid_motion(points: FloatArray, moved: FloatArray, weight: FloatArray | None = None) -> RigidMotion:
    """The rigid motion that best explains displacements ``moved`` [k, 2] m of ``points`` [k, 2] m.

    Weighted least squares in closed form (planar Procrustes problem), exact for finite rotation. ``weight`` [k] ≥ 0.
    Fewer than two distinct points of positive weight leave it unobservable.
    """
    start, moved = np.zeros((1, *points.shape)), np.ascontiguousarray(moved)[None]
    w = np.ones(len(points)) if weight is None else weight
    found = fit_motion(np.ascontiguousarray(points)[None], start, moved, np.ascontiguousarray(w)[None])
    return RigidMotion((found.x, found.y), (found.dx, found.dy), found.rotation)
