"""Time steps of the reduced world, compiled."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slipcore.compilation import compiled
from slipcore.contact.defaults import WORLD
from slipcore.frames import BoolArray, FloatArray

Places = NDArray[np.int64]


_AT_LIMIT, _REST = WORLD.at_limit, WORLD.rest

NONE = np.zeros(0)


class Pad(NamedTuple):
    """Bristles at ``x``, ``y`` [k] m; ``influence`` [o, 3]: displacement (m) along x by 1 N along x on another bristle,
    along y by 1 N along y, and along either by 1 N along the other. The place of a bristle less that of the loaded one,
    plus ``same``, is the row of ``influence``. ``pressing``: a³ over the normal force, m³/N (Hertz). Under a measured
    pressure in place of Hertz's: the ``share`` [k] of the normal force on each bristle, and the ``depth`` [k] m by 1 N.
    """

    x: FloatArray
    y: FloatArray
    place: Places
    influence: FloatArray
    same: int
    pressing: float
    share: FloatArray = NONE
    depth: FloatArray = NONE


class TouchingBristles(NamedTuple):
    """The bristles that touch: their numbers ``which`` [i]; ``near`` [3, i, i]: displacement of one by 1 N on another,
    as in ``Pad.influence``; ``moved`` [2, i] m: that by all forces, kept up as these change.
    """

    which: Places
    near: FloatArray
    moved: FloatArray


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

    Where the object moves across the surface and tilts, too, ``half_width`` m: from its centre to a finger, whose ball
    has the radius ``sphere`` m and whose gel the ``modulus`` E*, Pa; 0 where it does not.
    """

    number: int
    length: float
    sweeps: int
    lag: float
    gel_time: float
    mass: float
    inertia: float
    half_width: float = 0.0
    sphere: float = 0.0
    modulus: float = 0.0


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
    """Go on in place, with the load [2, 6] changing evenly from its first row to its second.

    Of each finger: ``friction`` [f, k] (coefficient), ``command`` and ``normal`` force [f] N of the gripper, and its
    ``bristles``; of the object: ``motion`` [2, 6] (pose; velocity) along x and y, about z, along z, about x and y (m,
    m, rad, m, rad, rad; the load in N and N·m). The second finger faces the first: all but x and what turns about it
    are turned round in its frame.
    """
    fingers = normal.shape[0]
    patches = [TouchingBristles(np.zeros(0, np.int64), np.zeros((3, 0, 0)), np.zeros((2, 0))) for _ in range(fingers)]
    for step in range(steps.number):
        resultant = np.zeros(6)
        motion[0] += steps.length * motion[1]
        target = motion[0] + steps.gel_time * motion[1]
        for f in range(fingers):
            side = 1.0 - 2.0 * f
            normal[f] += (command[f] - normal[f]) * -math.expm1(-steps.length / steps.lag)
            seat = seat_of(pad, normal[f], target, side, steps.half_width, steps.sphere, steps.modulus)
            limit = friction[f] * pressures(pad, seat.normal, seat.x, seat.y)
            if not are_these(limit, patches[f].which):
                leave(limit, bristles.force[f], bristles.offset[f], bristles.slips[f])
                patches[f] = patch_of(pad, np.flatnonzero(limit > 0.0), bristles.force[f])
            settle(
                pad,
                patches[f],
                limit,
                seat.pose,
                bristles.force[f],
                bristles.offset[f],
                bristles.slips[f],
                steps.sweeps,
            )
            sheared = on_object(pad, patches[f].which, bristles.force[f], side)
            resultant[:3] += sheared
            if steps.half_width > 0.0:
                resultant += across(sheared, seat.normal, target, side, steps.half_width, steps.sphere)
        share = (step + 1.0) / steps.number
        driving = load[0] + share * (load[1] - load[0]) - resultant
        motion[1, :2] += steps.length / steps.mass * driving[:2]
        motion[1, 2] += steps.length / steps.inertia * driving[2]
        if steps.half_width > 0.0:
            motion[1, 3] += steps.length / steps.mass * driving[3]
            motion[1, 4:] += steps.length / steps.inertia * driving[4:]


class Seat(NamedTuple):
    """How an object sits on a finger, in its frame: the ``pose`` [3] (m, m, rad) of its surface there, the ``normal``
    force, N, and the middle of the contact at ``x``, ``y`` m.
    """

    pose: FloatArray
    normal: float
    x: float
    y: float


@compiled
def seat_of(
    pad: Pad, normal: float, pose: FloatArray, side: float, half_width: float, sphere: float, modulus: float
) -> Seat:
    """The seat of an object at ``pose`` [6] on a finger that the gripper presses with ``normal`` N.

    A tilt moves its surface along the finger's, and the contact on the ball, by the angle times ``half_width`` and
    ``sphere``. The jaws move together, so that the gel is relieved by how far the object is away, with Hertz's
    stiffness dF/dδ = 2aE* (Johnson, Contact Mechanics, 1985, eq. 4.23).
    """
    surface = np.array([pose[0], side * pose[1], side * pose[2]])
    if half_width == 0.0:
        return Seat(surface, normal, 0.0, 0.0)
    about_x, about_y = pose[4], side * pose[5]
    surface[0] -= half_width * about_y
    surface[1] += half_width * about_x
    stiffness = 2.0 * modulus * (pad.pressing * max(normal, 0.0)) ** (1.0 / 3.0)
    return Seat(surface, max(normal - stiffness * side * pose[3], 0.0), sphere * about_y, -sphere * about_x)


@compiled
def across(
    sheared: FloatArray, normal: float, pose: FloatArray, side: float, half_width: float, sphere: float
) -> FloatArray:
    """What a finger that is ``sheared`` [3] by an object at ``pose`` [6] bears beside that, [6] N and N·m.

    The moments of its shear about the object's centre, and its normal force, which acts along the tilted surface's
    normal where the contact has moved to.
    """
    about_x, about_y = pose[4], pose[5]
    lever = normal * (half_width + sphere)
    return np.array(
        [
            -normal * side * about_y,
            side * normal * about_x,
            0.0,
            -side * normal,
            side * half_width * sheared[1] + lever * about_x,
            -side * half_width * sheared[0] + lever * about_y,
        ]
    )


@compiled
def are_these(limit: FloatArray, which: Places) -> bool:
    """Whether just the bristles of these numbers have a limit above 0."""
    found = 0
    for k in range(limit.size):
        if limit[k] > 0.0:
            if found == which.size or which[found] != k:
                return False
            found += 1
    return found == which.size


@compiled
def pressures(pad: Pad, normal: float, x: float = 0.0, y: float = 0.0) -> FloatArray:
    """Normal force on each bristle, [k] N, under ``normal`` N in all: the measured share, or Hertz's pressure about
    (``x``, ``y``) m.
    """
    height = np.zeros(pad.x.size)
    if normal <= 0.0:
        return height
    if pad.share.size:
        return normal * pad.share
    square = (pad.pressing * normal) ** (2.0 / 3.0)
    for k in range(height.size):
        height[k] = math.sqrt(max(1.0 - ((pad.x[k] - x) ** 2 + (pad.y[k] - y) ** 2) / square, 0.0))
    total = height.sum()
    return height * (normal / total) if total > 0.0 else height


@compiled
def depths(pad: Pad, normal: float, sphere: float, x: float = 0.0, y: float = 0.0) -> FloatArray:
    """Normal displacement of the surface, [k] m, under a ball of radius ``sphere`` m at (``x``, ``y``) m and ``normal``
    N, or by the measured pressure.

    Johnson, Contact Mechanics (1985), eq. 3.42.
    """
    if pad.share.size:
        return normal * pad.depth
    square = (pad.pressing * normal) ** (2.0 / 3.0)
    depth = np.zeros(pad.x.size)
    for k in range(depth.size if square > 0.0 else 0):
        r2 = (pad.x[k] - x) ** 2 + (pad.y[k] - y) ** 2
        if r2 <= square:
            depth[k] = (square - 0.5 * r2) / sphere
        else:
            edge = math.sqrt(square * (r2 - square))
            depth[k] = ((2.0 * square - r2) * math.atan2(square, edge) + edge) / (math.pi * sphere)
    return depth


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
    """Let bristles follow an object at ``pose`` [3] (m, m, rad), each up to its ``limit`` [k] N, in place."""
    leave(limit, force, offset, slips)
    settle(pad, patch_of(pad, np.flatnonzero(limit > 0.0), force), limit, pose, force, offset, slips, sweeps)


@compiled
def leave(limit: FloatArray, force: FloatArray, offset: FloatArray, slips: BoolArray) -> None:
    """Free the bristles without a ``limit`` [k] N, in place: the offset of what does not touch is NaN."""
    for k in np.flatnonzero(limit == 0.0):
        force[k], offset[k], slips[k] = 0.0, np.nan, False


@compiled
def patch_of(pad: Pad, which: Places, force: FloatArray) -> TouchingBristles:
    """The bristles of these numbers as a patch, under the forces [k, 2] N on all."""
    near = np.empty((3, which.size, which.size))
    for i, k in enumerate(which):
        for j in range(which.size):
            row = pad.same + pad.place[which[j]] - pad.place[k]
            for component in range(3):
                near[component, i, j] = pad.influence[row, component]
    moved = np.zeros((2, which.size))
    for i, k in enumerate(which):
        spread(near, i, force[k, 0], force[k, 1], moved)
    return TouchingBristles(which, near, moved)


@compiled
def settle(
    pad: Pad,
    patch: TouchingBristles,
    limit: FloatArray,
    pose: FloatArray,
    force: FloatArray,
    offset: FloatArray,
    slips: BoolArray,
    sweeps: int,
) -> None:
    """Let what touches follow an object at ``pose`` [3] (m, m, rad), each bristle up to its ``limit`` [k] N, in place.

    Projected Gauss-Seidel on the displacement of the surface by all forces, from the last step's forces. What changed
    by less than ``WORLD.rest`` of its limit waits for the next step. What was cut to its limit is offset by what it
    lacks.
    """
    x, y, yaw = pose
    along_x, along_y = pad.influence[pad.same, 0], pad.influence[pad.same, 1]
    cut = np.zeros(patch.which.size, np.bool_)
    for i, k in enumerate(patch.which):
        if np.isnan(offset[k, 0]):  # touches anew: where the surface is, it sticks
            put(pad, patch, pose, i, offset)
    for _ in range(sweeps):
        rests = True
        for i, k in enumerate(patch.which):
            more_x = (x - yaw * pad.y[k] - offset[k, 0] - patch.moved[0, i]) / along_x
            more_y = (y + yaw * pad.x[k] - offset[k, 1] - patch.moved[1, i]) / along_y
            held = force[k, 0] ** 2 + force[k, 1] ** 2 <= limit[k] ** 2
            if held and more_x**2 + more_y**2 <= (_REST * limit[k]) ** 2:
                continue
            wanted_x, wanted_y = force[k, 0] + more_x, force[k, 1] + more_y
            share = limit[k] / max(limit[k], math.hypot(wanted_x, wanted_y))
            spread(patch.near, i, share * wanted_x - force[k, 0], share * wanted_y - force[k, 1], patch.moved)
            force[k, 0], force[k, 1] = share * wanted_x, share * wanted_y
            cut[i], rests = share < 1.0, False
        if rests:
            break
    for i, k in enumerate(patch.which):
        slips[k] = math.hypot(force[k, 0], force[k, 1]) >= _AT_LIMIT * limit[k]
        if cut[i]:
            put(pad, patch, pose, i, offset)


@compiled
def put(pad: Pad, patch: TouchingBristles, pose: FloatArray, i: int, offset: FloatArray) -> None:
    """Let the i-th bristle of a patch hold the object where it now is: by its ``offset`` [k, 2] m, in place."""
    k = patch.which[i]
    offset[k, 0] = pose[0] - pose[2] * pad.y[k] - patch.moved[0, i]
    offset[k, 1] = pose[1] + pose[2] * pad.x[k] - patch.moved[1, i]


@compiled
def displaced(pad: Pad, force: FloatArray) -> FloatArray:
    """Displacement [k, 2] m of all bristles by the ``force`` [k, 2] N on them."""
    moved = np.zeros(force.shape)
    for k in np.flatnonzero((force[:, 0] != 0.0) | (force[:, 1] != 0.0)):
        for j in range(len(moved)):
            x, y, turned = pad.influence[pad.same + pad.place[j] - pad.place[k]]
            moved[j, 0] += x * force[k, 0] + turned * force[k, 1]
            moved[j, 1] += turned * force[k, 0] + y * force[k, 1]
    return moved


@compiled(fastmath={"contract"})
def spread(near: FloatArray, source: int, force_x: float, force_y: float, moved: FloatArray) -> None:
    """Add the displacement by a force (N) on one bristle of a patch to that of all its bristles, [2, i] m, in place."""
    along_x, along_y, across = near[0, source], near[1, source], near[2, source]
    moved_x, moved_y = moved[0], moved[1]
    for j in range(moved_x.size):
        moved_x[j] += along_x[j] * force_x + across[j] * force_y
        moved_y[j] += across[j] * force_x + along_y[j] * force_y


@compiled
def on_object(pad: Pad, which: Places, force: FloatArray, side: float) -> FloatArray:
    """Force and moment that the object meets from these bristles, in the first finger's frame, [3] N, N, N·m."""
    total = np.zeros(3)
    for k in which:
        total[0] += force[k, 0]
        total[1] += side * force[k, 1]
        total[2] += side * (pad.x[k] * force[k, 1] - pad.y[k] * force[k, 0])
    return total
