"""Measurement noise of a recorded series."""

import numpy as np

from slipcore.frames import FloatArray
from slipcore.kernels.noise import noise_of_series


def estimate_noise(time: FloatArray, series: FloatArray) -> float:
    """Standard deviation of one value of recorded series [t, axes, k]; NaN for fewer than 3 frames.

    As a detector estimates it online: the middle of three values is compared with the line through its neighbours, at
    the true times, so that uneven frames do no harm, and of the last frames' estimates the median counts.
    """
    return float(noise_of_series(np.ascontiguousarray(time), np.ascontiguousarray(series)))
