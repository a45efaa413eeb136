"""What a contact patch feels as a whole, and the least friction that bears it."""

import math
from typing import NamedTuple

import numpy as np

from slipcore.compilation import compiled
from slipcore.defaults import PATCHES
from slipcore.frames import BoolArray, FloatArray
from slipcore.limit_surface import Descent, find_limit_load

CLOSE_ENOUGH = Descent(PATCHES.descents, PATCHES.settled, PATCHES.still, PATCHES.rank, PATCHES.free_motion)
"""To 0.1 %."""
_LEAST_SQUARE_ARM = PATCHES.least_square_arm


class Resultants(NamedTuple):
    """Force and moment on a patch: arrays [t], NaN (``normal_force`` 0) where nothing presses.

    ``normal_force`` N along the patch's mean normal; ``tangential_force`` [t, 2] N across it, the first component
    nearest to x; ``moment`` N·m about it at the centre of pressure; ``load_ratio``: the least friction coefficient that
    bears force and moment, which is that of the patch once all of it slips; ``element_force`` Σ f_n²/Σ f_n N: mean
    normal force of an element, weighted by force.
    """

    normal_force: FloatArray
    tangential_force: FloatArray
    moment: FloatArray
    load_ratio: FloatArray
    element_force: FloatArray


def resultants(
    force: FloatArray, normal: FloatArray, place: FloatArray, patch: BoolArray, kernel_width: float = 0.0
) -> Resultants:
    """Of the force [t, n, m, 3] N on the elements of a ``patch`` [t, n, m], at ``place`` [t, n, m, 3] m, with outward
    unit normals [t, n, m, 3].

    Sums are of signed forces, so that noise around the patch adds nothing to them on average. Forces that a sensor
    smooths over ``kernel_width`` m (standard deviation) reach further out than those that act: their mean square arm is
    larger by twice the square of it, while F_n, F_T and M stay.
    """
    sums = _of_frames(_for_kernels(force), _for_kernels(normal), _for_kernels(place), patch, kernel_width)
    return Resultants(sums[:, 0], sums[:, 1:3], *sums[:, 3:].T)


def _for_kernels(field: FloatArray) -> FloatArray:
    """The field as one type of array, contiguous and not to be written to: kernels are compiled for each type."""
    view = np.ascontiguousarray(field).view()
    view.flags.writeable = False
    return view


@compiled
def _of_frames(
    force: FloatArray, normal: FloatArray, place: FloatArray, patch: BoolArray, kernel_width: float
) -> FloatArray:
    """Of all frames, [t, 6]."""
    sums = np.empty((len(force), 6))
    for k in range(len(force)):
        sums[k] = _of_frame(force[k], normal[k], place[k], patch[k], kernel_width)
    return sums


@compiled
def _of_frame(
    force: FloatArray, normal: FloatArray, place: FloatArray, patch: BoolArray, kernel_width: float
) -> tuple[float, float, float, float, float, float]:
    """Of one frame, in the order of ``Resultants``."""
    axes = _axes(_mean_normal(force, normal, patch))
    f, r = _in_axes(force, patch, axes), _in_axes(place, patch, axes)
    total = f.sum(axis=0)
    pressing = -f[:, 2]
    if not total[2] < 0.0:
        return 0.0, math.nan, math.nan, math.nan, math.nan, math.nan
    x, y = r[:, 0] + (pressing * r[:, 0]).sum() / total[2], r[:, 1] + (pressing * r[:, 1]).sum() / total[2]
    moment = (x * f[:, 1] - y * f[:, 0]).sum()
    mean_square = -(pressing * (x * x + y * y)).sum() / total[2]
    share = 1.0
    if mean_square > 0.0:
        share = math.sqrt(max(1.0 - 2.0 * kernel_width**2 / mean_square, _LEAST_SQUARE_ARM))
    load, arm = np.array([total[0], total[1], moment]), share * np.stack((x, y))
    factor = find_limit_load(pressing, arm, load, np.ones(3, np.bool_), CLOSE_ENOUGH).factor
    ratio = 1.0 / factor if factor > 0.0 else math.hypot(total[0], total[1]) / -total[2]
    return -total[2], total[0], total[1], moment, ratio, -(pressing * pressing).sum() / total[2]


@compiled
def _in_axes(field: FloatArray, patch: BoolArray, axes: FloatArray) -> FloatArray:
    """A field [n, m, 3] at the elements of the patch, along the rows of ``axes``: [k, 3]."""
    found = np.empty((np.count_nonzero(patch), 3))
    k = 0
    for i in range(patch.shape[0]):
        for j in range(patch.shape[1]):
            if patch[i, j]:
                found[k] = axes @ field[i, j]
                k += 1
    return found


@compiled
def _axes(upward: FloatArray) -> FloatArray:
    """Rows: the direction along the surface that is nearest to x, the one square to it, and the normal."""
    x, y, z = upward
    length = math.sqrt(y * y + z * z)
    return np.array([[length, -x * y / length, -x * z / length], [0.0, z / length, -y / length], [x, y, z]])


@compiled
def _mean_normal(force: FloatArray, normal: FloatArray, patch: BoolArray) -> FloatArray:
    """Mean outward normal of a patch, weighted by what presses: single normals err by degrees, their mean less."""
    mean = np.zeros(3)
    for i in range(patch.shape[0]):
        for j in range(patch.shape[1]):
            if patch[i, j]:
                weight = -(force[i, j] * normal[i, j]).sum()
                if weight > 0.0:
                    mean += weight * normal[i, j]
    length = math.sqrt((mean * mean).sum())
    return mean / length if length > 0.0 else np.array([0.0, 0.0, 1.0])
