"""Where a marker is, by its neighbours, too, under noise that lasts: slip differs little between them, noise wholly."""

import math

import numpy as np
from numpy.typing import NDArray

from slipcore.compilation import compiled
from slipcore.detection.filter.pose import Anchors, Pose, place_on_object
from slipcore.frames import FloatArray


@compiled
def find_offsets(anchors: Anchors, pose: Pose, places: NDArray[np.int64], offsets: FloatArray) -> None:
    """Fill how far markers are from their anchors on the object, ``offsets`` [2, n, m] m; NaN for all others."""
    offsets[:] = math.nan
    for e in range(len(places)):
        i, j = places[e]
        x, y = place_on_object(pose, anchors.marker_x[e], anchors.marker_y[e])
        offsets[0, i, j], offsets[1, i, j] = x - anchors.x[e], y - anchors.y[e]


@compiled
def pooled_offset(offsets: FloatArray, i: int, j: int, scale: float, beside: float) -> tuple[float, float, float]:
    """How far an element's marker offsets, x and y m, as it and its eight neighbours show, and what share of the
    variance of a marker coordinate is left.

    The four next to it weigh ``beside``, those aslant the square of that, and each less the farther it is off by d,
    for that is slip: 1/(1 + d²/s)² (Geman and McClure, 1987) with the ``scale`` s, m².
    """
    if beside == 0.0:
        return offsets[0, i, j], offsets[1, i, j], 1.0
    n, m = offsets.shape[1:]
    own_x, own_y = offsets[0, i, j], offsets[1, i, j]
    total, squares, x, y = 1.0, 1.0, own_x, own_y
    for a in range(max(i - 1, 0), min(i + 2, n)):
        for b in range(max(j - 1, 0), min(j + 2, m)):
            apart = (offsets[0, a, b] - own_x) ** 2 + (offsets[1, a, b] - own_y) ** 2
            if (a == i and b == j) or math.isnan(apart):
                continue
            weight = beside if a == i or b == j else beside * beside
            weight /= (1.0 + apart / scale) ** 2
            total += weight
            squares += weight * weight
            x += weight * offsets[0, a, b]
            y += weight * offsets[1, a, b]
    return x / total, y / total, squares / (total * total)
