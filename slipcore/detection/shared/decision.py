"""What follows from a decision: slip of what may slip, stick ratio, and velocity relative to the object."""

import math

from slipcore.compilation import compiled
from slipcore.detection.shared.records import Decision, DetectorSetup, FrameArrays, Memory, Workspace, named
from slipcore.detection.shared.rigid_motion import RigidMotion, fit_motion
from slipcore.frames import FloatArray


@compiled
def decide_frame(
    sensor: DetectorSetup,
    last: FrameArrays,
    frame: FrameArrays,
    before: Memory,
    after: Memory,
    room: Workspace,
    velocity: FloatArray,
) -> tuple[int, int]:
    """``apply_decision`` of that in the ``room``; what it is given may be plain tuples of the same entries."""
    sensor, last, frame, before, after, room = named(sensor, last, frame, before, after, room)
    return apply_decision(sensor.position, last, frame, room.decision, before, after, room.weight, velocity)


@compiled(inline=True)
def apply_decision(
    position: FloatArray,
    last: FrameArrays,
    frame: FrameArrays,
    decision: Decision,
    before: Memory,
    after: Memory,
    weight: FloatArray,
    velocity: FloatArray,
) -> tuple[int, int]:
    """Fill slip and ``probability`` of the memory ``after``, ``velocity`` [n, m, 2], and on the way to it ``weight``
    [n, m]; how many elements touch and how many of them slip.

    What was not in contact before has not slipped. The velocity is that over the interval from the ``last`` frame, of
    what was in contact all through it, relative to the object: this moves as its poses say, or if one is missing as the
    elements do that stick before and after, the more surely the more. NaN where it is unobservable.
    """
    contact, was, slip = after.contact, before.contact, after.slip
    start, end, pose_before, pose = last.displacement, frame.displacement, last.object_pose, frame.object_pose
    interval = frame.time - last.time
    n, m = contact.shape
    touching = slipping = 0
    known = pose_before.size > 0 and pose.size > 0
    for i in range(n):
        for j in range(m):
            stays = contact[i, j] and was[i, j]
            s = decision.slip[i, j] and stays
            p = decision.probability[i, j] if stays else 0.0
            slip[i, j], after.probability[i, j] = s, p
            touching += contact[i, j]
            slipping += s
            sticks = stays and not s and not before.slip[i, j]
            weight[i, j] = (1.0 - p) * (1.0 - before.probability[i, j]) if sticks else 0.0
    if known:
        dx, dy, turn = pose[0] - pose_before[0], pose[1] - pose_before[1], pose[2] - pose_before[2]
        motion = RigidMotion(pose_before[0], pose_before[1], dx, dy, turn)
    else:
        motion = fit_motion(position, start, end, weight)
    sine, versine = math.sin(motion.rotation), 2.0 * math.sin(0.5 * motion.rotation) ** 2
    for i in range(n):
        for j in range(m):
            u = v = math.nan
            if contact[i, j] and was[i, j]:
                rx, ry = position[i, j, 0] + start[i, j, 0] - motion.x, position[i, j, 1] + start[i, j, 1] - motion.y
                u = (end[i, j, 0] - start[i, j, 0] - (motion.dx - versine * rx - sine * ry)) / interval
                v = (end[i, j, 1] - start[i, j, 1] - (motion.dy + sine * rx - versine * ry)) / interval
            velocity[i, j, 0], velocity[i, j, 1] = u, v
    return touching, slipping
