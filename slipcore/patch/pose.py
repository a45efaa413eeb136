"""Where a contact patch lies on the lattice of markers."""

import math

import numpy as np

from slipcore.compilation import compiled
from slipcore.frames import FloatArray
from slipcore.patch.spans import IntArray, Spans, elements_at, for_kernels


def lattice_pose(
    spans: Spans, weight: FloatArray, position: FloatArray, least_anisotropy: float
) -> tuple[FloatArray, FloatArray]:
    """Where patches lie among the markers at rest, [k, 3] x m, y m, yaw rad, and their radius of gyration, [k] m.

    ``weight`` [t, n, m]: pressure or depth. The yaw is that of the longer principal axis, continuous over the frames of
    a patch; NaN where (a² − b²)/(a² + b²) of the half-axes is under ``least_anisotropy``. All NaN where nothing has
    weight. What sticks to the markers stays where it is.
    """
    moments = np.empty((len(spans.frame), 5))
    _fill_moments(spans, for_kernels(weight), for_kernels(position), moments)
    x, y, xx, xy, yy = moments.T
    difference, mixed, size = xx - yy, 2.0 * xy, xx + yy
    oblong = np.hypot(difference, mixed) > least_anisotropy * size
    yaw = np.where(oblong, 0.5 * np.arctan2(mixed, difference), np.nan)
    _make_continuous(yaw, spans.bounds)
    return np.column_stack([x, y, yaw]), np.sqrt(size)


@compiled
def _fill_moments(spans: Spans, weight: FloatArray, position: FloatArray, moments: FloatArray) -> None:
    """Of each frame of a patch, [k, 5]."""
    for e, k in enumerate(spans.frame):
        moments[e] = _moments(weight[k], position, elements_at(spans, e))


@compiled
def _moments(weight: FloatArray, position: FloatArray, patch: IntArray) -> tuple[float, float, float, float, float]:
    """Mean x, y m of elements by ``weight`` [n, m], and mean x², xy, y² about it, m²; 0 of a single one."""
    total = x = y = xx = xy = yy = 0.0
    pressed = 0
    for i, j in patch:
        pressed += weight[i, j] > 0.0
        total += weight[i, j]
        x += weight[i, j] * position[i, j, 0]
        y += weight[i, j] * position[i, j, 1]
    if not total > 0.0:
        return math.nan, math.nan, math.nan, math.nan, math.nan
    x, y = x / total, y / total
    for i, j in patch if pressed > 1 else patch[:0]:
        w, dx, dy = weight[i, j] / total, position[i, j, 0] - x, position[i, j, 1] - y
        xx, xy, yy = xx + w * dx * dx, xy + w * dx * dy, yy + w * dy * dy
    return x, y, xx, xy, yy


@compiled
def _make_continuous(yaw: FloatArray, bounds: IntArray) -> None:
    """Let an axis turn by no more than a quarter turn from one known yaw [k] of a patch to the next."""
    for p in range(len(bounds) - 1):
        turns, last = 0.0, math.nan
        for e in range(bounds[p], bounds[p + 1]):
            seen = yaw[e]
            if math.isnan(seen):
                continue
            if not math.isnan(last):
                turns -= np.rint((seen - last) / np.pi)
            yaw[e] = seen + np.pi * turns
            last = seen
