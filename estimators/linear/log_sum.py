"""Sums of probabilities that are given by their logarithms."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


def log_sum(log: FloatArray, axis: int | None = None) -> Any:
    """Log Σ exp(log) along an axis, or over all; -inf where all are.

    As ``scipy.special.logsumexp``, which takes 0.1 to 0.2 ms for arrays of every kind however little there is to sum:
    four fifths of a look at a surface's change.
    """
    largest = np.max(log, axis=axis, keepdims=True)
    largest = np.where(np.isneginf(largest), 0.0, largest)
    with np.errstate(divide="ignore"):  # the logarithm of 0
        return np.log(np.sum(np.exp(log - largest), axis=axis)) + np.squeeze(largest, axis)
