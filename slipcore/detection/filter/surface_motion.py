"""How the object's surface moves: as what sticks says, or as far as it follows the known motion of its body."""

import math

import numpy as np

from slipcore.compilation import compiled
from slipcore.defaults import NUMERICS
from slipcore.detection.filter.pose import (
    Anchors,
    Pose,
    PoseVariance,
    find_pose,
    place_of_object,
    place_on_object,
    pose_at,
)
from slipcore.detection.filter.pose_noise import PoseNoise, noise_of_pose, own_variance, without_noise
from slipcore.detection.filter.state import CORRECTION, FOLLOWING, FORCE_FRAMES, POSE, SHAKING
from slipcore.detection.filter.tuning import Tuning
from slipcore.detection.shared.records import FrameArrays
from slipcore.frames import FloatArray

_LEAST_SPREAD = NUMERICS.least_spread
NOT_GIVEN = np.zeros(0)


@compiled(inline=True)
def step_pose(
    anchors: Anchors,
    before: Pose,
    last: FrameArrays,
    frame: FrameArrays,
    variance: float,
    tuning: Tuning,
    common: FloatArray,
) -> tuple[Pose, PoseVariance]:
    """Where the surface is now, put into ``common`` too; ``variance`` of a marker coordinate, m²."""
    pose, spread = find_pose(anchors, before, NOT_GIVEN, variance, tuning)
    if common[SHAKING] > 0.0:  # markers show where they are themselves, and no pose does
        common[CORRECTION:FORCE_FRAMES] = 0.0
    elif frame.object_pose.size and last.object_pose.size:
        step = frame.object_pose - last.object_pose
        step[2] = math.atan2(math.sin(step[2]), math.cos(step[2]))
        if len(anchors.x) < 2:
            common[FOLLOWING] = common[FOLLOWING + 1] = tuning.following_weight
            common[CORRECTION:FORCE_FRAMES] = 0.0
            known, left = frame.object_pose.copy(), spread
        else:
            noise = noise_of_pose(frame.object_pose, pose, spread, common)
            carried = body_motion(anchors, last.object_pose, step)
            learn_following(anchors, before, pose, spread, carried, noise, tuning, common)
            share = following_share(common, tuning)
            was = before.x - common[CORRECTION], before.y - common[CORRECTION + 1], before.yaw - common[CORRECTION + 2]
            now = pose_at(was[0] + share * step[0], was[1] + share * step[1], was[2] + share * step[2], 1.0)
            noise = PoseNoise(share * noise.place, share * noise.yaw, noise.known)
            known, left = without_noise(now, step, pose, spread, noise, tuning, common)
        pose, spread = find_pose(anchors, before, known, variance, tuning)
        if len(anchors.x) >= 2:
            spread = PoseVariance(left.place, left.yaw + spread.yaw, left.x, left.y)
    store_pose(common, POSE, pose)
    return pose, spread


@compiled
def stored_pose(common: FloatArray, at: int) -> Pose:
    """The pose that the common state holds at an index."""
    return pose_at(common[at], common[at + 1], common[at + 2], common[at + 3])


@compiled
def store_pose(common: FloatArray, at: int, pose: Pose) -> None:
    """Put a pose into the common state."""
    for value in range(4):
        common[at + value] = pose[value]


@compiled
def body_motion(anchors: Anchors, pose: FloatArray, step: FloatArray) -> tuple[float, float, float, float]:
    """Centre of the anchors' markers, m, and how far a ``step`` of the body from its ``pose`` [3] carries it, m."""
    x, y = anchors.marker_x.mean(), anchors.marker_y.mean()
    return x, y, step[0] - step[2] * (y - pose[1]), step[1] + step[2] * (x - pose[0])


@compiled
def learn_following(
    anchors: Anchors,
    before: Pose,
    fitted: Pose,
    spread: PoseVariance,
    carried: tuple[float, float, float, float],
    noise: PoseNoise,
    tuning: Tuning,
    common: FloatArray,
) -> None:
    """Learn the share of the body's motion that the surface of a soft object follows, while little slips.

    Least squares of the fitted motion f on the carried one d, which has noise, too (Fuller, Measurement Error Models,
    1987): Σw f·d/Σw(d² − σ²), w the inverse variance of a step and σ² that of d. Not before this is known.
    """
    if not noise.known:
        return
    x, y, dx, dy = carried
    ax, ay = place_on_object(before, x, y)
    fx, fy = place_of_object(fitted, ax, ay)
    size = dx * dx + dy * dy
    of_step = 4.0 * own_variance(noise.place, spread.place, tuning)  # of two places, along x and along y
    weight = 1.0 / (spread.place + of_step + tuning.following_variance * size + _LEAST_SPREAD)
    along = (fx - x) * dx + (fy - y) * dy
    begins = common[FOLLOWING + 1] < tuning.following_learning * tuning.following_weight
    if along > 0.0 and (begins or anchors.stick.mean() > tuning.following_stick):
        common[FOLLOWING] += weight * along
        common[FOLLOWING + 1] += weight * (size - of_step)


@compiled
def following_share(common: FloatArray, tuning: Tuning) -> float:
    """The share learnt; all of it while it is not clearly less."""
    known = common[FOLLOWING + 1]
    share = common[FOLLOWING] / known if known > 0.0 else 1.0
    if share > tuning.following_whole or (1.0 - share) ** 2 * known < tuning.following_deviations**2:
        return 1.0
    return float(share)
