"""Whether anything happens: while neither the object nor the load moves, frames say no more than the ones before."""

import math

from slipcore.compilation import compiled
from slipcore.detection.filter.pose import Anchors, Pose, PoseVariance, place_of_object, pose_at
from slipcore.detection.filter.state import HELD_FRAMES, HELD_LOAD, HELD_POSE, HELD_PRESSING, STILL
from slipcore.detection.filter.tuning import Tuning
from slipcore.detection.shared.records import FrameArrays, Surface
from slipcore.frames import BoolArray, FloatArray


@compiled(inline=True)
def step_hold(
    anchors: Anchors,
    pose: Pose,
    spread: PoseVariance,
    frame: FrameArrays,
    noise: tuple[float, float, float],
    has_force: bool,
    tuning: Tuning,
    common: FloatArray,
) -> bool:
    """Whether pose and load have been still for longer than ``hold_time``; what is remembered of that, in ``common``.

    They are compared with their means since something last happened: it happens where the markers under the object, or
    a component of the load, lie ``hold_deviations`` standard deviations off these. So a slow motion counts at any frame
    rate, and white noise hardly ever, however many frames there are. ``noise``: interval s, variance of a marker
    coordinate m², and deviation of an element's force N.
    """
    interval, variance, force_noise = noise
    load, load_variance = load_of(frame, has_force, variance, force_noise, tuning)
    frames = common[HELD_FRAMES]
    if frames == 0.0 or moved(anchors, pose, spread, tuning, common) or changed(load, load_variance, tuning, common):
        common[HELD_FRAMES] = common[STILL] = 0.0
        frames = 0.0
    else:
        common[STILL] += interval
    share = 1.0 / (frames + 1.0)
    for value in range(4):
        common[HELD_POSE + value] += share * (pose[value] - common[HELD_POSE + value])
    for axis in range(3):
        common[HELD_LOAD + axis] += share * (load[axis] - common[HELD_LOAD + axis])
    common[HELD_FRAMES] = frames + 1.0 if len(anchors.x) else 0.0
    return bool(common[STILL] > tuning.hold_time)


@compiled
def keeps_contact(
    frame: FrameArrays, noise: tuple[float, float], has_force: bool, tuning: Tuning, common: FloatArray
) -> bool:
    """Whether elements touch as they did, but for noise: all was held in the last frame and the load has not changed.

    By noise elements at the rim come and go, and each would begin at the place that the jitter of the fitted pose gives
    it: a random walk of the pose, which ends the hold. ``noise``: variance of a marker coordinate m², and deviation of
    an element's force N. A contact that is given is that.
    """
    if frame.contact.size or common[STILL] <= tuning.hold_time:
        return False
    load, variance = load_of(frame, has_force, noise[0], noise[1], tuning)
    return not changed(load, variance, tuning, common)


@compiled
def hold_contact(elements: FloatArray, before: BoolArray, surface: Surface, most: float, contact: BoolArray) -> None:
    """Let elements touch as ``before`` [n, m] whose normal force N, or without forces depth m, lies within ``most`` of
    its mean in this hold.

    Any other has changed: a body may roll, pivot or slide under a load that does not.
    """
    n, m = before.shape
    for i in range(n):
        for j in range(m):
            if abs(surface.pressing[i, j] - elements[HELD_PRESSING, i, j]) <= most:
                contact[i, j] = before[i, j]
            surface.stays[i, j] = contact[i, j] and before[i, j]


@compiled
def follow_held_pressing(elements: FloatArray, pressing: FloatArray, frames: float, after: FloatArray) -> None:
    """Each element's mean normal force N, or depth m, [n, m] over the ``frames`` since a change, with this one."""
    share = 1.0 / max(frames, 1.0)
    n, m = pressing.shape
    for i in range(n):
        for j in range(m):
            mean = elements[HELD_PRESSING, i, j]
            after[HELD_PRESSING, i, j] = mean + share * (pressing[i, j] - mean)


@compiled
def load_of(
    frame: FrameArrays, has_force: bool, variance: float, force_noise: float, tuning: Tuning
) -> tuple[tuple[float, float, float], float]:
    """The sum of all forces, N, and the variance of a component of it, N²; without forces the sum of how deep markers
    lie, m, alone, and its variance, m². Of all elements, lest one at the rim come and go.
    """
    field = frame.force if has_force else frame.displacement
    n, m, _ = field.shape
    x = y = z = 0.0
    for i in range(n):
        for j in range(m):
            x += field[i, j, 0]
            y += field[i, j, 1]
            z += field[i, j, 2]
    if not has_force:
        return (0.0, 0.0, z), n * m * variance
    return (x, y, z), n * m * force_noise**2 + tuning.ratio_least_force**2


@compiled
def moved(anchors: Anchors, pose: Pose, spread: PoseVariance, tuning: Tuning, common: FloatArray) -> bool:
    """Whether the pose parts from its mean by more than its noise (root mean square over the anchors)."""
    mean = pose_at(common[HELD_POSE], common[HELD_POSE + 1], common[HELD_POSE + 2], common[HELD_POSE + 3])
    strayed = jitter = 0.0
    for e in range(len(anchors.x)):
        px, py = place_of_object(pose, anchors.x[e], anchors.y[e])
        hx, hy = place_of_object(mean, anchors.x[e], anchors.y[e])
        strayed += (px - hx) ** 2 + (py - hy) ** 2
        jitter += spread.place + spread.yaw * ((px - spread.x) ** 2 + (py - spread.y) ** 2)
    jitter += tuning.displacement_floor**2
    return bool(strayed > tuning.hold_deviations**2 * (1.0 + 1.0 / common[HELD_FRAMES]) * jitter)


@compiled
def changed(load: tuple[float, float, float], variance: float, tuning: Tuning, common: FloatArray) -> bool:
    """Whether a component of the load parts from its mean by more than its noise."""
    most = tuning.hold_deviations * math.sqrt((1.0 + 1.0 / common[HELD_FRAMES]) * variance)
    far = 0.0
    for axis in range(3):
        far = max(far, abs(load[axis] - common[HELD_LOAD + axis]))
    return far > most
