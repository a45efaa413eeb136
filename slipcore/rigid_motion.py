"""Planar rigid motion between frames, and the velocity of the surface relative to the object."""

import math
from typing import NamedTuple

import numpy as np

from slipcore.frames import BoolArray, FloatArray


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


UNOBSERVABLE = RigidMotion((math.nan, math.nan), (math.nan, math.nan), math.nan)


def fit_rigid_motion(points: FloatArray, moved: FloatArray, weight: FloatArray | None = None) -> RigidMotion:
    """The rigid motion that best explains displacements ``moved`` [k, 2] m of ``points`` [k, 2] m.

    Weighted least squares in closed form (planar Procrustes problem), exact for finite rotation. ``weight`` [k] ≥ 0.
    Fewer than two distinct points of positive weight leave it ``UNOBSERVABLE``.
    """
    w = np.ones(len(points)) if weight is None else weight
    total = w.sum()
    if not total > 0.0:
        return UNOBSERVABLE
    (x, y), (u, v) = points.T, moved.T
    start = float(w @ x / total), float(w @ y / total)
    translation = float(w @ u / total), float(w @ v / total)
    x, y, u, v = x - start[0], y - start[1], u - translation[0], v - translation[1]
    spread = float(w @ (x * x + y * y))
    if not spread > (np.finfo(float).eps * np.abs(points).max()) ** 2 * total:
        return UNOBSERVABLE
    rotation = math.atan2(float(w @ (x * v - y * u)), spread + float(w @ (x * u + y * v)))
    return RigidMotion(start, translation, rotation)


def pose_motion(before: FloatArray, after: FloatArray) -> RigidMotion:
    """The rigid motion between two object poses (x m, y m, yaw rad)."""
    x, y, yaw = (float(value) for value in before)
    return RigidMotion((x, y), (float(after[0]) - x, float(after[1]) - y), float(after[2]) - yaw)


def relative_velocity(
    points: FloatArray, moved: FloatArray, observed: BoolArray, motion: RigidMotion, interval: float
) -> FloatArray:
    """Tangential velocity of surface elements relative to an object in rigid motion: [n, m, 2] m/s.

    ``points`` [n, m, 2] m where the elements stood, ``moved`` [n, m, 2] m their displacement in ``interval`` s.
    NaN where not ``observed`` [n, m], and everywhere when the motion is unobservable.
    """
    if not motion.observable:
        return np.full(points.shape, np.nan)
    velocity = (moved - motion.displacement(points)) / interval
    velocity[~observed] = np.nan
    return velocity
