"""Time steps of the reduced world, compiled."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slipcore.compilation import compiled
from slipcore.contact.defaults import WORLD
from slipcore.frames import BoolArray, FloatArray

Places = NDArray[np.int64]


_CUT, _AT_LIMIT = 1.0 - WORLD.cut, WORLD.at_limit


class Pad(NamedTuple):
    """Bristles at ``x``, ``y`` [k] m; ``influence`` [o, 3]: displacement (m) along x by 1 N along x on another bristle,
    along y by 1 N along y, and along either by 1 N along the other. The place of a bristle less that of the loaded one,
    plus ``same``, is the row of ``influence``. ``pressing``: a³ over the normal force, m³/N (Hertz).
    """

    x: FloatArray
    y: FloatArray
    place: Places
    influence: FloatArray
    same: int
    pressing: float


class Bristles(NamedTuple):
    """State of the bristles of f fingers: ``force`` [f, k, 2] N on each, ``offset`` [f, k, 2] m by which it has slipped
    (NaN: apart), and whether it ``slips`` [f, k].
    """

    force: FloatArray
    offset: FloatArray
    slips: BoolArray


class Steps(NamedTuple):
    """How to go on: ``number`` of steps of ``length`` s, ``sweeps`` over the bristles in each; ``lag`` of the gripper
    and ``gel_time`` of the gel, s; ``mass`` kg, ``inertia`` kg m².
    """

    number: int
    length: float
    sweeps: int
    lag: float
    gel_time: float
    mass: float
    inertia: float


@compiled
def advance(
    pad: Pad,
    steps: Steps,
    friction: FloatArray,
    command: FloatArray,
    load: FloatArray,
    normal: FloatArray,
    motion: FloatArray,
    bristles: Bristles,
) -> None:
    """Go on in place, with the load [2, 3] (N, N, N·m) changing evenly from its first row to its second.

    Of each finger: ``friction`` [f, k] (coefficient), ``command`` and ``normal`` force [f] N, and its ``bristles``; of
    the object: ``motion`` [2, 3] (pose; velocity). The second finger faces the first: y and yaw are turned round in its
    frame.
    """
    fingers = normal.shape[0]
    for step in range(steps.number):
        resultant = np.zeros(3)
        motion[0] += steps.length * motion[1]
        target = motion[0] + steps.gel_time * motion[1]
        for f in range(fingers):
            side = 1.0 - 2.0 * f
            normal[f] += (command[f] - normal[f]) * -math.expm1(-steps.length / steps.lag)
            limit = friction[f] * pressures(pad, normal[f])
            pose = target * np.array([1.0, side, side])
            relax(pad, limit, pose, bristles.force[f], bristles.offset[f], bristles.slips[f], steps.sweeps)
            resultant += on_object(pad, bristles.force[f], side)
        share = (step + 1.0) / steps.number
        driving = load[0] + share * (load[1] - load[0]) - resultant
        motion[1, :2] += steps.length / steps.mass * driving[:2]
        motion[1, 2] += steps.length / steps.inertia * driving[2]


@compiled
def pressures(pad: Pad, normal: float) -> FloatArray:
    """Normal force on each bristle, [k] N, under ``normal`` N in all: Hertz's pressure at its place."""
    height = np.zeros(pad.x.size)
    if normal <= 0.0:
        return height
    square = (pad.pressing * normal) ** (2.0 / 3.0)
    for k in range(height.size):
        height[k] = math.sqrt(max(1.0 - (pad.x[k] ** 2 + pad.y[k] ** 2) / square, 0.0))
    total = height.sum()
    return height * (normal / total) if total > 0.0 else height


@compiled
def relax(
    pad: Pad,
    limit: FloatArray,
    pose: FloatArray,
    force: FloatArray,
    offset: FloatArray,
    slips: BoolArray,
    sweeps: int,
) -> None:
    """Let bristles follow an object at ``pose`` [3] (m, m, rad), each up to its ``limit`` [k] N, in place.

    Projected Gauss-Seidel on the displacement of the surface by all forces, from the last step's forces; what slips is
    then offset by what it lacks. The offset of what does not touch is NaN.
    """
    x, y, yaw = pose
    touching = np.flatnonzero(limit > 0.0)
    for k in np.flatnonzero(limit == 0.0):
        force[k], offset[k] = 0.0, np.nan
    wanted = np.empty((touching.size, 2))
    for i, k in enumerate(touching):
        shorten(force[k], limit[k])
        wanted[i, 0], wanted[i, 1] = x - yaw * pad.y[k], y + yaw * pad.x[k]
    moved = displaced(pad, touching, touching, force)
    for i, k in enumerate(touching):
        if np.isnan(offset[k, 0]):  # touches anew: where the surface is, it sticks
            offset[k] = wanted[i] - moved[i]
    for _ in range(sweeps):
        for i, k in enumerate(touching):
            before_x, before_y = force[k, 0], force[k, 1]
            force[k, 0] += (wanted[i, 0] - offset[k, 0] - moved[i, 0]) / pad.influence[pad.same, 0]
            force[k, 1] += (wanted[i, 1] - offset[k, 1] - moved[i, 1]) / pad.influence[pad.same, 1]
            shorten(force[k], limit[k])
            spread(pad, int(k), force[k, 0] - before_x, force[k, 1] - before_y, touching, moved)
    slips[:] = False
    for i, k in enumerate(touching):
        factor = math.hypot(force[k, 0], force[k, 1]) / limit[k]
        slips[k] = factor >= _AT_LIMIT
        if factor >= _CUT:
            offset[k] = wanted[i] - moved[i]


@compiled
def shorten(vector: FloatArray, limit: float) -> None:
    """Cut a vector [2] to the length ``limit``, in place."""
    length = math.hypot(vector[0], vector[1])
    if length > limit:
        vector *= limit / length


@compiled
def displaced(pad: Pad, at: Places, loaded: Places, force: FloatArray) -> FloatArray:
    """Displacement [i, 2] m of the bristles ``at`` by the ``force`` on those that are ``loaded``."""
    moved = np.zeros((at.size, 2))
    for k in loaded:
        spread(pad, int(k), force[k, 0], force[k, 1], at, moved)
    return moved


@compiled
def spread(pad: Pad, source: int, force_x: float, force_y: float, at: Places, moved: FloatArray) -> None:
    """Add the displacement by a force (N) on one bristle to that of the bristles ``at``, [i, 2] m, in place."""
    origin = pad.same - pad.place[source]
    for i in range(at.size):
        x, y, turned = pad.influence[origin + pad.place[at[i]]]
        moved[i, 0] += x * force_x + turned * force_y
        moved[i, 1] += turned * force_x + y * force_y


@compiled
def on_object(pad: Pad, force: FloatArray, side: float) -> FloatArray:
    """Force and moment that the object meets from one finger, in the first finger's frame, [3] N, N, N·m."""
    total = np.zeros(3)
    for k in range(pad.x.size):
        total[0] += force[k, 0]
        total[1] += side * force[k, 1]
        total[2] += side * (pad.x[k] * force[k, 1] - pad.y[k] * force[k, 0])
    return total
