"""What the places of a grasp shift its friction by: an error that more samples of the same places don't average out."""

import numpy as np
from numpy.typing import NDArray

from estimators.linear.fit_data import FitData
from estimators.linear.grasp_statistics import GraspStatistics
from estimators.linear.least_squares import whole_triangle

FloatArray = NDArray[np.float64]


def error_of_places(data: FitData) -> FloatArray:
    """Covariance [3, 3] of the least-squares β of these grasps where friction scatters between places with variance 1.

    (XᵀX)⁻¹ (Σ t tᵀ) (XᵀX)⁻¹ with t = Σ w x over the samples of a place (Liang & Zeger, 1986); 0 along what the samples
    don't determine it.
    """
    grasps = data.grasp_statistics()
    triangle = whole_triangle(data.factor).astype(float)[:, :3]
    size = np.sqrt((triangle**2).sum(axis=0))
    size[size == 0.0] = 1.0
    half = np.linalg.pinv(triangle / size)
    unit = data.effective_n / sum(grasp.total_weight for grasp in grasps)
    shared = unit**2 * sum(_of_grasp(grasp) for grasp in grasps) / np.outer(size, size)
    return np.asarray(half @ half.T @ shared @ half @ half.T / np.outer(size, size))


def _of_grasp(grasp: GraspStatistics) -> FloatArray:
    """Σ t tᵀ over its places: of a group of places their number times that of the mean, and the spread about it."""
    rows = np.column_stack([np.ones(len(grasp.mean)), grasp.mean[:, :2]])
    square = np.einsum("e,ei,ej->ij", grasp.count * grasp.weight**2, rows, rows)
    square[1:, 1:] += np.einsum("e,eki,ekj->ij", grasp.weight**2, grasp.spread[..., :2], grasp.spread[..., :2])
    return np.asarray(square)
