"""Noise that parts a given pose from the markers: of its measurement, or of a camera that shakes."""

import math
from typing import NamedTuple

import numpy as np

from slipcore.compilation import compiled
from slipcore.defaults import DEVIATION_TO_SIGMA, NOISE
from slipcore.detection.filter.pose import Pose, PoseVariance, place_of_object, place_on_object, pose_at
from slipcore.detection.filter.state import CORRECTION, LAST_OFFSETS, NOISE_OF_PLACE, NOISE_OF_YAW, OFFSET_FRAMES
from slipcore.detection.filter.tuning import Tuning
from slipcore.frames import FloatArray
from slipcore.noise import recent_median, remember

_RING = 1 + NOISE.memory
SECOND_DIFFERENCE = math.sqrt(6.0)
"""Standard deviation of the second difference of white noise, over its own."""
OF_PLANE = 1.0 / math.sqrt(math.log(2.0))
"""Standard deviation over the median of the root mean square of two components (Rayleigh)."""
LEAST = NOISE.memory // 4
"""Frames before noise counts: of fewer the median is too uncertain."""


class PoseNoise(NamedTuple):
    """Standard deviation of the noise of a given pose's place, m, and yaw, rad, infinite while it is not ``known``."""

    place: float
    yaw: float
    known: bool


@compiled
def noise_of_pose(given: FloatArray, fitted: Pose, spread: PoseVariance, common: FloatArray) -> PoseNoise:
    """Noise of a ``given`` pose [3], m, m, rad, from the second differences of its offset from that ``fitted`` to the
    markers, in the median over the last frames. Keeps these in ``common``.

    Slip, and a soft object's surface that stays behind, part them slowly or once: what differs from frame to frame is
    noise, that of the fit among it.
    """
    return _noise(_offset(pose_at(given[0], given[1], given[2], 1.0), fitted, spread), common)


@compiled
def own_variance(noise: float, of_fit: float, tuning: Tuning) -> float:
    """Variance that noise of this standard deviation has beyond what may be the fit's own."""
    return max(noise * noise - tuning.pose_noise_least * of_fit, 0.0)


@compiled
def without_noise(
    known: Pose,
    step: FloatArray,
    fitted: Pose,
    spread: PoseVariance,
    noise: PoseNoise,
    tuning: Tuning,
    common: FloatArray,
) -> tuple[FloatArray, PoseVariance]:
    """The ``known`` pose, after a ``step`` [3], m, m, rad, moved towards that ``fitted`` to the markers as far as its
    ``noise`` beyond that of the fit and of slip in so large a step parts them; and the variance of what it then is.

    Keeps the correction in ``common``; while the noise is unknown the pose is that fitted, and goes on from there.
    """
    ax, ay = place_on_object(fitted, spread.x, spread.y)
    offset = _offset(known, fitted, spread)
    size = step[0] * step[0] + step[1] * step[1]
    place = _share(own_variance(noise.place, spread.place, tuning), spread.place, tuning.following_variance * size)
    yaw = _share(own_variance(noise.yaw, spread.yaw, tuning), spread.yaw, tuning.following_variance * step[2] ** 2)
    kx, ky = spread.x - offset[0], spread.y - offset[1]
    turned = pose_at(0.0, 0.0, known.yaw + yaw * offset[2], 1.0)
    x, y = place_of_object(turned, ax, ay)
    moved = np.array([kx + place * offset[0] - x, ky + place * offset[1] - y, turned.yaw])
    if noise.known:
        common[CORRECTION], common[CORRECTION + 1] = moved[0] - known.x, moved[1] - known.y
        common[CORRECTION + 2] = moved[2] - known.yaw
    return moved, PoseVariance(place * spread.place, yaw * spread.yaw, spread.x, spread.y)


@compiled
def _offset(known: Pose, fitted: Pose, spread: PoseVariance) -> FloatArray:
    """How far the fitted pose lies from the known one where it is known best: x, y m, yaw rad."""
    ax, ay = place_on_object(fitted, spread.x, spread.y)
    kx, ky = place_of_object(known, ax, ay)
    turn = math.atan2(math.sin(fitted.yaw - known.yaw), math.cos(fitted.yaw - known.yaw))
    return np.array([spread.x - kx, spread.y - ky, turn])


@compiled
def _share(of_noise: float, of_fit: float, of_slip: float) -> float:
    """Share that the variance of noise beyond slip has in it and in the variance of the fit."""
    variance = max(of_noise - of_slip, 0.0)
    if variance == math.inf:
        return 1.0
    return variance / (variance + of_fit) if variance > 0.0 else 0.0


@compiled
def _noise(offset: FloatArray, common: FloatArray) -> PoseNoise:
    """Noise of place and yaw, once another ``offset`` [3] is known."""
    last, before = common[LAST_OFFSETS : LAST_OFFSETS + 3], common[LAST_OFFSETS + 3 : LAST_OFFSETS + 6]
    places, yaws = common[NOISE_OF_PLACE : NOISE_OF_PLACE + _RING], common[NOISE_OF_YAW : NOISE_OF_YAW + _RING]
    if common[OFFSET_FRAMES] >= 2.0:
        second = (offset - 2.0 * last + before) / SECOND_DIFFERENCE
        remember(places, OF_PLANE * math.sqrt(0.5 * (second[0] * second[0] + second[1] * second[1])))
        remember(yaws, DEVIATION_TO_SIGMA * abs(second[2]))
    before[:] = last
    last[:] = offset
    common[OFFSET_FRAMES] += 1.0
    if places[0] < LEAST:
        return PoseNoise(math.inf, math.inf, False)
    ordered = np.empty(_RING)
    return PoseNoise(recent_median(places, ordered), recent_median(yaws, ordered), True)
