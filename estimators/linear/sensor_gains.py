"""What the grasps of several sensors say of each sensor's own gain, beside the friction that they all felt."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from estimators.linear.hierarchical import Conditional, Hierarchical, Whole

FloatArray = NDArray[np.float64]


class Gains(NamedTuple):
    """Gains s of sensors at nodes [m] of the posterior: ``mean`` [m, s], ``covariance`` [m, s, s] and that with β,
    ``with_coefficients`` [m, s, 3]. ``names`` of the sensors.
    """

    mean: FloatArray
    covariance: FloatArray
    with_coefficients: FloatArray
    names: tuple[str, ...]

    def moments(self, weight: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Mean [s] and covariance [s, s] over nodes of these ``weight`` [m]."""
        mean = weight @ self.mean
        away = self.mean - mean
        covariance = np.einsum("m,mij->ij", weight, self.covariance)
        return mean, covariance + np.einsum("m,mi,mj->ij", weight, away, away)


def gains(model: Hierarchical, whole: Whole, given: Conditional, sigma: FloatArray) -> Gains:
    """The sensors' gains at points [m], each normal given β and the scales, and so together with β.

    ν/(1 + ν q) hᵀ(residual) with the variance σ²ν/(1 + ν q), q = hᵀh (Searle et al., 1992, ch. 7). What unknown
    velocities are off by keeps its prior here, which leaves no gain better known than it is.
    """
    slope = -whole.weight[..., None] * (whole.gain[..., :3] @ np.linalg.inv(model.pooled.root))
    away = given.mean - model.pooled.mean
    mean = whole.weight * whole.gain[..., 3] + np.einsum("msi,mi->ms", slope, away)
    with_coefficients = slope @ given.covariance
    covariance = with_coefficients @ slope.swapaxes(1, 2) + model.offset * (whole.off @ whole.off.swapaxes(1, 2))
    own = np.arange(len(model.sensors))
    covariance[:, own, own] += sigma[:, None] ** 2 * whole.weight
    return Gains(mean, covariance, with_coefficients, model.sensors)
