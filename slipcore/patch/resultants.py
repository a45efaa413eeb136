"""What a contact patch feels as a whole, and the least friction that bears it."""

import math
from typing import NamedTuple

import numpy as np

from slipcore.compilation import compiled
from slipcore.defaults import PATCHES
from slipcore.frames import FloatArray
from slipcore.limit_surface import Descent, find_limit_load
from slipcore.patch.spans import IntArray, Spans, elements_at, for_kernels

CLOSE_ENOUGH = Descent(PATCHES.descents, PATCHES.settled, PATCHES.still, PATCHES.rank, PATCHES.free_motion)
"""To 0.1 %."""
_LEAST_SQUARE_ARM, _SIGNIFICANT = PATCHES.least_square_arm, PATCHES.significant


class Resultants(NamedTuple):
    """Force and moment on patches: arrays [k] over their frames, NaN (``normal_force`` 0) where nothing presses.

    ``normal_force`` N along the patch's mean normal; ``tangential_force`` [k, 2] N across it, the first component
    nearest to x; ``moment`` N·m about it at the centre of pressure; ``load_ratio``: the least friction coefficient that
    bears force and moment, which is that of the patch once all of it slips, and the standard deviation
    ``ratio_noise`` that noise of the forces gives it, both NaN where what presses is not beyond noise;
    ``element_force`` Σ f_n²/Σ f_n N: mean normal force of an element, weighted by force.
    """

    normal_force: FloatArray
    tangential_force: FloatArray
    moment: FloatArray
    load_ratio: FloatArray
    element_force: FloatArray
    ratio_noise: FloatArray


def resultants(
    force: FloatArray,
    normal: FloatArray,
    place: FloatArray,
    spans: Spans,
    kernel_width: float = 0.0,
    force_noise: FloatArray | float = 0.0,
) -> Resultants:
    """Of the force [t, n, m, 3] N on the elements of patches, at ``place`` [t, n, m, 3] m, with outward unit normals
    [t, n, m, 3].

    Sums are of signed forces, so that noise around the patch adds nothing to them on average. Forces that a sensor
    smooths over ``kernel_width`` m (standard deviation) reach further out than those that act: their mean square arm is
    larger by twice the square of it, while F_n, F_T and M stay. ``force_noise`` [k, 2] N on an
    element, of each component across the normal, and along it; or one for all.
    """
    fields = for_kernels(force), for_kernels(normal), for_kernels(place)
    sums, noise = np.empty((len(spans.frame), 7)), np.broadcast_to(force_noise, (len(spans.frame), 2))
    _fill_sums(*fields, spans, kernel_width, for_kernels(noise), sums)
    return Resultants(sums[:, 0], sums[:, 1:3], *sums[:, 3:].T)


@compiled
def _fill_sums(
    force: FloatArray,
    normal: FloatArray,
    place: FloatArray,
    spans: Spans,
    kernel_width: float,
    force_noise: FloatArray,
    sums: FloatArray,
) -> None:
    """Of all frames of the patches, [k, 7]."""
    for e, k in enumerate(spans.frame):
        patch = elements_at(spans, e)
        sums[e] = _of_frame(force[k], normal[k], place[k], patch, kernel_width, force_noise[e])


@compiled
def _of_frame(
    force: FloatArray,
    normal: FloatArray,
    place: FloatArray,
    patch: IntArray,
    kernel_width: float,
    force_noise: FloatArray,
) -> tuple[float, float, float, float, float, float, float]:
    """Of one frame, in the order of ``Resultants``."""
    pressing, arm, load, _ = felt_by(force, normal, place, patch)
    total = pressing.sum()
    if not total > 0.0:
        return 0.0, math.nan, math.nan, math.nan, math.nan, math.nan, math.nan
    mean_square, shrunk = (pressing * (arm[0] * arm[0] + arm[1] * arm[1])).sum() / total, 1.0
    if mean_square > 0.0:
        shrunk = math.sqrt(max(1.0 - 2.0 * kernel_width**2 / mean_square, _LEAST_SQUARE_ARM))
    ratio, noise = _load_ratio(pressing, arm, shrunk, load, force_noise)
    return total, load[0], load[1], load[2], ratio, (pressing * pressing).sum() / total, noise


@compiled
def felt_by(
    force: FloatArray, normal: FloatArray, place: FloatArray, patch: IntArray
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Normal forces [e] of a frame's elements, their arms [2, e] about the centre of pressure, the load on the patch:
    F_x, F_y and M, and the axes [3, 3] of x, y and the normal. Arms and load are NaN where nothing presses.
    """
    axes = _axes(_mean_normal(force, normal, patch))
    f, r = _in_axes(force, patch, axes), _in_axes(place, patch, axes)
    pressing, arm = -f[2], r[:2]
    total = pressing.sum()
    if not total > 0.0:
        return pressing, np.full_like(arm, math.nan), np.full(3, math.nan), axes
    for axis in range(2):
        arm[axis] -= (pressing * arm[axis]).sum() / total
    return pressing, arm, np.array([f[0].sum(), f[1].sum(), (arm[0] * f[1] - arm[1] * f[0]).sum()]), axes


@compiled
def _load_ratio(
    pressing: FloatArray, arm: FloatArray, shrunk: float, load: FloatArray, force_noise: FloatArray
) -> tuple[float, float]:
    """The least friction coefficient that bears a load (F_x, F_y, M), and its standard deviation; NaN where what
    presses is not beyond noise. Of the arms [2, e] of the forces, those of what acts are ``shrunk`` by this factor.

    In any motion friction has to take up at least what the load does, so that each gives a ratio of both; the largest
    is the answer. A patch of few elements hardly resists a rotation, in which noise of elements around it seems to do
    much: only where the ratio of both is surer than that of the translation along the force is it taken.
    """
    motion = find_limit_load(pressing, shrunk * arm, load, np.ones(3, np.bool_), CLOSE_ENOUGH).motion
    along = np.array([load[0], load[1], 0.0]) if load[0] != 0.0 or load[1] != 0.0 else np.array([1.0, 0.0, 0.0])
    (ratio, noise), (shifted, its_noise) = (
        _ratio_in(motion, pressing, arm, shrunk, load, force_noise),
        _ratio_in(along, pressing, arm, shrunk, load, force_noise),
    )
    if math.isnan(shifted) or ratio - _SIGNIFICANT * noise >= shifted - _SIGNIFICANT * its_noise:
        return ratio, noise
    return shifted, its_noise


@compiled
def _ratio_in(
    motion: FloatArray, pressing: FloatArray, arm: FloatArray, shrunk: float, load: FloatArray, force_noise: FloatArray
) -> tuple[float, float]:
    """What a load does in a motion over what friction of coefficient 1 takes up, and the standard deviation of that.

    They have the noise σ √Σ|B_i d|² of forces across the normal, and along it, with the arms at which these are summed.
    Where friction takes up nothing beyond noise nothing is known: NaN.
    """
    done, taken, square = (motion * load).sum(), 0.0, 0.0
    for i in range(pressing.size):
        turned_x, turned_y = -arm[1, i] * motion[2], arm[0, i] * motion[2]
        taken += pressing[i] * math.hypot(motion[0] + shrunk * turned_x, motion[1] + shrunk * turned_y)
        square += (motion[0] + turned_x) ** 2 + (motion[1] + turned_y) ** 2
    across, along = force_noise[0] * math.sqrt(square), force_noise[1] * math.sqrt(square)
    if not taken > _SIGNIFICANT * along:
        return math.nan, math.nan
    return done / taken, math.hypot(across, along * done / taken) / taken


@compiled
def _in_axes(field: FloatArray, patch: IntArray, axes: FloatArray) -> FloatArray:
    """A field [n, m, 3] at the elements of the patch, along the rows of ``axes``: [3, k]."""
    found = np.empty((3, len(patch)))
    for e in range(len(patch)):
        i, j = patch[e, 0], patch[e, 1]
        x, y, z = field[i, j, 0], field[i, j, 1], field[i, j, 2]
        for axis in range(3):
            found[axis, e] = axes[axis, 0] * x + axes[axis, 1] * y + axes[axis, 2] * z
    return found


@compiled
def _axes(upward: tuple[float, float, float]) -> FloatArray:
    """Rows: the direction along the surface that is nearest to x, the one square to it, and the normal."""
    x, y, z = upward
    length = math.sqrt(y * y + z * z)
    return np.array([[length, -x * y / length, -x * z / length], [0.0, z / length, -y / length], [x, y, z]])


@compiled
def _mean_normal(force: FloatArray, normal: FloatArray, patch: IntArray) -> tuple[float, float, float]:
    """Mean outward normal of a patch, weighted by what presses: single normals err by degrees, their mean less."""
    x = y = z = 0.0
    for e in range(len(patch)):
        i, j = patch[e, 0], patch[e, 1]
        n_x, n_y, n_z = normal[i, j, 0], normal[i, j, 1], normal[i, j, 2]
        weight = -(force[i, j, 0] * n_x + force[i, j, 1] * n_y + force[i, j, 2] * n_z)
        if weight > 0.0:
            x += weight * n_x
            y += weight * n_y
            z += weight * n_z
    length = math.sqrt(x * x + y * y + z * z)
    return (x / length, y / length, z / length) if length > 0.0 else (0.0, 0.0, 1.0)
