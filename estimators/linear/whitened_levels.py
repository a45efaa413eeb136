"""Compiled sums over the levels of a grasp's places, whose errors go together over time."""

import math

import numpy as np
from numpy.typing import NDArray

from slipcore.compilation import compiled

FloatArray = NDArray[np.float64]


@compiled()
def filtered(
    rows: FloatArray, own: FloatArray, kept: FloatArray, share: FloatArray, log_size: FloatArray
) -> FloatArray:
    """Products [c, c, m], of which the lower half is written, of columns ``rows`` [b, c] of one place made independent
    and of one variance in m ways; the logarithm of the root of the determinant of what they are divided by is added to
    ``log_size`` [m].

    Each stretch is compared with what those before it say (Kalman, 1960, Journal of Basic Engineering 82:35). All ways
    go on together, for which processors have instructions.
    """
    stretches, columns = rows.shape
    ways = len(kept)
    ahead, mean, square = np.zeros((columns, ways)), np.zeros((columns, ways)), np.zeros((columns, columns, ways))
    lasting = 1.0 - share
    variance, returning = lasting.copy(), (1.0 - kept * kept) * lasting
    unit, gain = np.empty(ways), np.empty(ways)
    for stretch in range(stretches):
        if own[stretch] > 0.0:
            for way in range(ways):
                total = variance[way] + share[way] * own[stretch]
                unit[way], gain[way] = 1.0 / total, variance[way] / total
                variance[way] *= 1.0 - gain[way]
            for way in range(ways):
                log_size[way] -= 0.5 * math.log(unit[way])
            for i in range(columns):
                for way in range(ways):
                    ahead[i, way] = rows[stretch, i] - mean[i, way]
                    mean[i, way] += gain[way] * ahead[i, way]
                for j in range(i + 1):
                    for way in range(ways):
                        square[i, j, way] += unit[way] * ahead[i, way] * ahead[j, way]
        for i in range(columns):
            for way in range(ways):
                mean[i, way] *= kept[way]
        for way in range(ways):
            variance[way] = kept[way] * kept[way] * variance[way] + returning[way]
    return square


@compiled()
def whitened(rows: FloatArray, own: FloatArray, kept: FloatArray, share: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Sums over places of the products [m, c − 1, c − 1] of all but the first of the columns of ``rows`` [p, b, c],
    made independent and of one variance, and the first of each place taken out; and the logarithm [m] of the root of
    the determinant of what they are divided by, and of the size of what is taken.

    In m ways of a ``share`` [m] of errors that is a stretch's own, of which the rest is ``kept`` [m] from one to the
    next. ``own`` [p, b]: relative variances of a stretch's own errors, 0 where nothing was seen.
    """
    columns, ways = rows.shape[2], len(kept)
    products, log_size = np.zeros((ways, columns - 1, columns - 1)), np.zeros(ways)
    for place in range(len(rows)):
        square = filtered(rows[place], own[place], kept, share, log_size)
        log_size += 0.5 * np.log(square[0, 0])
        for i in range(1, columns):
            for j in range(1, i + 1):
                products[:, i - 1, j - 1] += square[i, j] - square[i, 0] * square[j, 0] / square[0, 0]
                products[:, j - 1, i - 1] = products[:, i - 1, j - 1]
    return products, log_size
