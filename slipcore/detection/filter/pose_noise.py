"""Noise that parts a given pose from the markers: of its measurement, or of a camera that shakes."""

import math

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


@compiled
def without_noise(
    known: Pose, step: FloatArray, fitted: Pose, spread: PoseVariance, tuning: Tuning, common: FloatArray
) -> tuple[FloatArray, PoseVariance]:
    """The ``known`` pose [3], m, m, rad, after a ``step`` [3], moved towards that ``fitted`` to the markers as far as
    noise parts them; and the variance of what it then is.

    Slip parts them slowly or once: what differs from frame to frame is noise, of the variance that second differences
    of their offset show, in the median, beyond those of the fit and of slip in so large a step. Keeps these, and the
    correction, in ``common``.
    """
    ax, ay = place_on_object(fitted, spread.x, spread.y)
    kx, ky = place_of_object(known, ax, ay)
    turn = math.atan2(math.sin(fitted.yaw - known.yaw), math.cos(fitted.yaw - known.yaw))
    offset = np.array([spread.x - kx, spread.y - ky, turn])
    of_place, of_yaw = _noise(offset, common)
    size = step[0] * step[0] + step[1] * step[1]
    place = _beyond(of_place, spread.place, tuning.following_variance * size, tuning)
    yaw = _beyond(of_yaw, spread.yaw, tuning.following_variance * step[2] * step[2], tuning)
    turned = pose_at(0.0, 0.0, known.yaw + yaw * turn, 1.0)
    x, y = place_of_object(turned, ax, ay)
    moved = np.array([kx + place * offset[0] - x, ky + place * offset[1] - y, turned.yaw])
    common[CORRECTION], common[CORRECTION + 1] = moved[0] - known.x, moved[1] - known.y
    common[CORRECTION + 2] = moved[2] - known.yaw
    return moved, PoseVariance(place * spread.place, yaw * spread.yaw, spread.x, spread.y)


@compiled
def _beyond(noise: float, of_fit: float, of_slip: float, tuning: Tuning) -> float:
    """Share that noise of this standard deviation has in it and in the variance of the fit."""
    variance = max(noise * noise - tuning.pose_noise_least * of_fit - of_slip, 0.0)
    return variance / (variance + of_fit) if variance > 0.0 else 0.0


@compiled
def _noise(offset: FloatArray, common: FloatArray) -> tuple[float, float]:
    """Standard deviation of the noise of place, m, and yaw, rad, once another ``offset`` [3] is known."""
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
        return 0.0, 0.0
    ordered = np.empty(_RING)
    return recent_median(places, ordered), recent_median(yaws, ordered)
