"""Grasps of which every force is known in closed form: a rigid body presses on a lattice of markers, and goes."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.ndimage import gaussian_filter

from slipcore import GraspLog

PITCH = 1e-3
POINTS = 20
FINE = 6
"""Sub-elements along each side of an element."""
RATE = 30.0


class Course(NamedTuple):
    """A body's way over the markers, all [t]: ``x`` m along x, ``yaw`` rad, and the ``share`` of its friction that its
    force (it then ``turns`` not) or its torque takes up, with its sign.
    """

    time: np.ndarray
    x: np.ndarray
    yaw: np.ndarray
    share: np.ndarray
    turns: bool


def ramp_and_go(travel: float, turns: bool, *, rest: float = 0.4, ramp: float = 1.0, go: float = 1.6) -> Course:
    """The load grows while nothing moves, then the body travels (m, or rad) under its whole friction."""
    time = np.arange(round((rest + ramp + go) * RATE)) / RATE
    share = np.clip((time - rest) / ramp, 0.0, 1.0)
    way = travel * np.clip((time - rest - ramp) / go, 0.0, 1.0)
    still = np.zeros_like(time)
    return Course(time, *((still, way) if turns else (way, still)), share, turns)


Law = Callable[[np.ndarray, np.ndarray], np.ndarray]
"""Friction by speed m/s and normal force N of an element."""


class Setting(NamedTuple):
    """The contact, and what its sensor adds: ``half_axes`` m of the oval and its largest ``pressure`` Pa; ``smoothing``
    of the forces over elements (standard deviation); ``crosstalk``: an inward share of the normal force, growing to the
    rim; ``marker_noise`` m and ``force_noise`` N, drawn by ``seed``.
    """

    half_axes: tuple[float, float] = (7e-3, 3.5e-3)
    pressure: float = 1e5
    smoothing: float = 0.0
    crosstalk: float = 0.0
    marker_noise: float = 0.0
    force_noise: float = 0.0
    seed: int = 0


USUAL = Setting()


def grasp(course: Course, friction: Law | float = 0.7, setting: Setting = USUAL) -> GraspLog:
    """The log of that body: ``friction`` a coefficient or a law.

    Markers follow half a millimetre of the load, and stay when the body goes on.
    """
    rng = np.random.default_rng(setting.seed)
    fine, points = _lattice(POINTS * FINE, PITCH / FINE), _lattice(POINTS, PITCH)
    force = np.stack([_force(course, k, friction, setting, fine) for k in range(len(course.time))])
    if setting.smoothing > 0.0:
        force = gaussian_filter(force, (0.0, setting.smoothing, setting.smoothing, 0.0))
    force[..., :2] += setting.crosstalk * force[..., 2:] * _outward(course, points) / setting.half_axes[0]
    follow = 5e-4 * course.share[:, None, None]
    shift = follow * np.ones((POINTS, POINTS))
    if course.turns:
        arm = points[..., :2] / setting.half_axes[0]
        sideways = np.stack([-follow * arm[..., 1], follow * arm[..., 0]], axis=-1)
    else:
        sideways = np.stack([shift, np.zeros_like(shift)], axis=-1)
    depth = 3e-4 * force[..., 2:] / np.abs(force[..., 2]).max()
    displacement = np.concatenate([sideways, depth], axis=-1)
    displacement += setting.marker_noise * rng.standard_normal(displacement.shape)
    force += setting.force_noise * rng.standard_normal(force.shape)
    normal = np.broadcast_to([0.0, 0.0, 1.0], force.shape)
    return GraspLog(course.time, points, displacement, PITCH**2, force=force, normal=normal)


def _outward(course: Course, points: np.ndarray) -> np.ndarray:
    """From the body's centre to each element, [t, n, n, 2] m."""
    centre = np.stack([course.x, np.zeros_like(course.x)], axis=-1)
    return np.asarray(points[..., :2] - centre[:, None, None])


def _lattice(points: int, pitch: float) -> np.ndarray:
    axis = pitch * (np.arange(points) - 0.5 * (points - 1))
    return np.stack([*np.meshgrid(axis, axis, indexing="ij"), np.zeros((points, points))], axis=-1)


def _force(course: Course, k: int, friction: Law | float, setting: Setting, fine: np.ndarray) -> np.ndarray:
    """Force on each element in frame ``k``, [n, n, 3] N: Coulomb's law at each point of the finer lattice."""
    x, y = fine[..., 0] - course.x[k], fine[..., 1]
    c, s = np.cos(course.yaw[k]), np.sin(course.yaw[k])
    inside = 1.0 - ((c * x + s * y) / setting.half_axes[0]) ** 2 - ((c * y - s * x) / setting.half_axes[1]) ** 2
    normal = setting.pressure * np.sqrt(np.maximum(inside, 0.0)) * (PITCH / FINE) ** 2
    radius = np.maximum(np.hypot(x, y), 1e-12)
    motion = np.gradient(course.yaw, course.time)[k] if course.turns else np.gradient(course.x, course.time)[k]
    speed = abs(motion) * (radius if course.turns else np.ones_like(radius))
    law = friction if callable(friction) else lambda _v, _f: np.full_like(normal, friction)
    limit = course.share[k] * law(speed, normal * FINE**2) * normal
    direction = np.stack([-y, x], axis=-1) / radius[..., None] if course.turns else np.array([1.0, 0.0])
    force = np.concatenate([limit[..., None] * direction, -normal[..., None]], axis=-1)
    size = len(fine) // FINE
    return np.asarray(force.reshape(size, FINE, size, FINE, 3).sum(axis=(1, 3)))


PIVOT = ramp_and_go(np.deg2rad(60.0), turns=True)
"""60° about the normal."""
SLIDE = ramp_and_go(3e-3, turns=False)
"""Three elements sideways."""
