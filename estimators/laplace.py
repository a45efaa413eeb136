"""Laplace's approximation of a smooth density: its mode, and the spread that its curvature there implies."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
LogDensity = Callable[[FloatArray], FloatArray]

STEP = 0.1
"""Finite-difference step, in units of the start's spread: wide enough for sums of 10⁶ rounded terms."""
ITERATIONS = 60
CLOSE = 0.02
"""Newton step, in standard deviations, below which a proposal gains nothing from a better mode."""
LENGTHS = np.array([1.0, 0.5, 0.25, 0.1, 0.03, 0.01, 0.001])


def laplace(log_density: LogDensity, start: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Mode [d] and root [d, d] of the covariance (root rootᵀ), by Newton steps from ``start`` [d].

    ``log_density`` takes [k, d] in coordinates whose posterior spread is about 1; every iteration is two calls, one
    for all differences and one for all step lengths. Directions without curvature get a spread of 3.
    """
    mode = np.asarray(start, dtype=float)
    root = np.eye(len(mode))
    for _ in range(ITERATIONS):
        gradient, hessian = _differences(log_density, mode, root)
        values, vectors = np.linalg.eigh(-hessian)
        spread = vectors / np.sqrt(np.maximum(values, 1.0 / 9.0))
        step = spread @ (spread.T @ gradient)
        size = float(np.linalg.norm(spread.T @ gradient))
        trial = mode + LENGTHS[:, None] * (root @ step)
        heights = log_density(np.vstack([trial, mode]))
        best = int(np.nanargmax(heights))
        mode = trial[best] if best < len(trial) else mode
        root = root @ spread
        if size < CLOSE or best == len(trial):
            break
    return mode, root


def _differences(log_density: LogDensity, at: FloatArray, root: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Gradient and Hessian along the columns of ``root``, by central differences in one call."""
    size = len(at)
    first, second = np.triu_indices(size, 1)
    unit = STEP * np.eye(size)
    moves = np.vstack([np.zeros((1, size)), unit, -unit, unit[first] + unit[second], -unit[first] - unit[second]])
    value = log_density(at + moves @ root.T)
    centre, plus, minus = value[0], value[1 : size + 1], value[size + 1 : 2 * size + 1]
    both = value[2 * size + 1 :].reshape(2, -1).sum(axis=0)
    hessian = np.diag(plus + minus - 2.0 * centre)
    curve = np.diag(hessian)
    hessian[first, second] = hessian[second, first] = 0.5 * (both - 2.0 * centre - curve[first] - curve[second])
    return (plus - minus) / (2.0 * STEP), hessian / STEP**2
