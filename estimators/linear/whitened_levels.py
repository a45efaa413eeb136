"""Compiled sums over the levels of a grasp's places, whose errors go together over time."""

import math

import numpy as np
from numpy.typing import NDArray

from slipcore.compilation import compiled

FloatArray = NDArray[np.float64]


@compiled()
def filtered(rows: FloatArray, own: FloatArray, kept: float, share: float, square: FloatArray) -> float:
    """Products ``square`` [c, c], of which the lower half is written, of columns ``rows`` [b, c] of one place made
    independent and of one variance; returns the logarithm of the root of the determinant of what they are divided by.

    Each stretch is compared with what those before it say (Kalman, 1960, Journal of Basic Engineering 82:35).
    """
    stretches, columns = rows.shape
    ahead, mean = np.zeros(columns), np.zeros(columns)
    variance, log_size = 1.0 - share, 0.0
    square[:] = 0.0
    for stretch in range(stretches):
        if own[stretch] > 0.0:
            total = variance + share * own[stretch]
            log_size += 0.5 * math.log(total)
            for i in range(columns):
                ahead[i] = rows[stretch, i] - mean[i]
                mean[i] += variance / total * ahead[i]
                for j in range(i + 1):
                    square[i, j] += ahead[i] * ahead[j] / total
            variance *= 1.0 - variance / total
        for i in range(columns):
            mean[i] *= kept
        variance = kept**2 * variance + (1.0 - kept**2) * (1.0 - share)
    return log_size


@compiled()
def whitened(rows: FloatArray, own: FloatArray, kept: FloatArray, share: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Sums over places of the products [m, c − 1, c − 1] of all but the first of the columns of ``rows`` [p, b, c],
    made independent and of one variance, and the first of each place taken out; and the logarithm [m] of the root of
    the determinant of what they are divided by, and of the size of what is taken.

    In m ways of a ``share`` [m] of errors that is a stretch's own, of which the rest is ``kept`` [m] from one to the
    next. ``own`` [p, b]: relative variances of a stretch's own errors, 0 where nothing was seen.
    """
    columns = rows.shape[2]
    products, log_size = np.zeros((len(kept), columns - 1, columns - 1)), np.zeros(len(kept))
    square = np.zeros((columns, columns))
    for way in range(len(kept)):
        for place in range(len(rows)):
            log_size[way] += filtered(rows[place], own[place], kept[way], share[way], square)
            log_size[way] += 0.5 * math.log(square[0, 0])
            for i in range(1, columns):
                for j in range(1, i + 1):
                    products[way, i - 1, j - 1] += square[i, j] - square[i, 0] * square[j, 0] / square[0, 0]
                    products[way, j - 1, i - 1] = products[way, i - 1, j - 1]
    return products, log_size
