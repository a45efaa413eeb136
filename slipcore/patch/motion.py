"""How an object moves over the markers under its contact patches."""

import math
from typing import NamedTuple

import numpy as np

from slipcore.compilation import compiled
from slipcore.defaults import PATCHES, PatchOptions
from slipcore.frames import BoolArray, FloatArray, GraspLog
from slipcore.patch.local_rates import local_rates
from slipcore.patch.spans import IntArray, Spans, elements_at, for_kernels


class PatchMotion(NamedTuple):
    """Of the object over the markers: ``velocity`` [k, 2] m/s at the patch's centre, and ``turning`` [k] m/s, its
    rotation times the patch's radius of gyration; ``travels`` and ``turns`` [k]: where they are more than their errors
    and than can be resolved; ``wanders`` [k]: where the patch itself travels on the lattice.
    """

    velocity: FloatArray
    turning: FloatArray
    travels: BoolArray
    turns: BoolArray
    wanders: BoolArray

    @property
    def speed(self) -> FloatArray:
        """Mean of the speed over the patch, about the root of the mean square: [k] m/s."""
        return np.asarray(np.hypot(np.hypot(*self.velocity.T), np.nan_to_num(self.turning)))


def motion_over_markers(
    log: GraspLog, spans: Spans, weight: FloatArray, pose: FloatArray, gyration: FloatArray, options: PatchOptions
) -> PatchMotion:
    """By the object's pose where the log has it; else by that of the patches on the lattice, [k, 3] m, m, rad.

    ``weight`` [t, n, m] of the elements, ``gyration`` [k] m of the patches. These go with their object unless it rolls.
    """
    time, object_pose = log.time[spans.frame], log.object_pose
    rate, error = local_rates(time, pose, spans.bounds, options.window)
    of_patch = _motion(rate, error, gyration, options.least_travel * math.sqrt(log.element_area) / options.window)
    if object_pose is None:
        return of_patch
    markers, centre = _marker_motion(log, spans, weight)
    object_pose = object_pose[spans.frame]
    (carried, its_error), (own, error) = (
        local_rates(time, each, spans.bounds, options.window) for each in (object_pose, markers)
    )
    arm = centre - object_pose[:, :2]
    at_centre = np.column_stack([carried[:, 0] - carried[:, 2] * arm[:, 1], carried[:, 1] + carried[:, 2] * arm[:, 0]])
    rate = np.column_stack([at_centre, carried[:, 2]]) - own
    of_object = _motion(rate, np.hypot(its_error, error), gyration, options.least_speed)
    return of_object._replace(wanders=of_patch.travels)


def _motion(rate: FloatArray, error: FloatArray, gyration: FloatArray, least: float) -> PatchMotion:
    velocity, turning = rate[:, :2], rate[:, 2] * gyration
    speed, spin = np.hypot(*velocity.T), np.abs(turning)
    travels = speed > np.maximum(least, PATCHES.significant * np.hypot(error[:, 0], error[:, 1]))
    turns = spin > np.maximum(least, PATCHES.significant * error[:, 2] * gyration)
    return PatchMotion(velocity, turning, travels, turns, travels)


def _marker_motion(log: GraspLog, spans: Spans, weight: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Rigid motion of the markers under patches since rest, [k, 3] m, m, rad (weighted planar Procrustes problem), and
    their centre [k, 2] m.
    """
    fit = np.full((len(spans.frame), 5), np.nan)
    _fill_fits(spans, for_kernels(weight), for_kernels(log.position), for_kernels(log.displacement), fit)
    return fit[:, :3], fit[:, 3:]


@compiled
def _fill_fits(
    spans: Spans, weight: FloatArray, position: FloatArray, displacement: FloatArray, fit: FloatArray
) -> None:
    """Motion and centre, [k, 5], where anything has weight."""
    for e, k in enumerate(spans.frame):
        patch = elements_at(spans, e)
        fit[e] = _fit(weight[k], position, displacement[k], patch)


@compiled
def _fit(
    weight: FloatArray, position: FloatArray, displacement: FloatArray, patch: IntArray
) -> tuple[float, float, float, float, float]:
    """Of one frame: how far the centre goes, x and y, and the turn; and where it then is, x and y."""
    total = x = y = u = v = cross = dot = 0.0
    for i, j in patch:
        w = weight[i, j]
        total += w
        x, y = x + w * position[i, j, 0], y + w * position[i, j, 1]
        u, v = u + w * displacement[i, j, 0], v + w * displacement[i, j, 1]
    if not total > 0.0:
        return math.nan, math.nan, math.nan, math.nan, math.nan
    x, y, u, v = x / total, y / total, u / total, v / total
    for i, j in patch:
        a, b = position[i, j, 0] - x, position[i, j, 1] - y
        c, d = a + displacement[i, j, 0] - u, b + displacement[i, j, 1] - v
        cross += weight[i, j] * (a * d - b * c)
        dot += weight[i, j] * (a * c + b * d)
    return u, v, math.atan2(cross, dot), x + u, y + v
