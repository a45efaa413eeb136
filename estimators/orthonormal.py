"""The orthonormal design behind a least-squares fit, in which covariances are simple and nothing is lost."""

import numpy as np
from numpy.typing import NDArray

from estimators.least_squares import LinearFit
from estimators.observations import Observations

FloatArray = NDArray[np.float64]


def orthonormal(observations: Observations, linear: LinearFit) -> tuple[FloatArray, FloatArray]:
    """Orthonormal design Q [n, r] and residuals [n], both times √w."""
    root = np.sqrt(observations.weight)
    mean, basis = linear.mean.astype(float), linear.basis.astype(float)
    regressors = np.stack([observations.tangential_velocity - mean[0], observations.normal_force - mean[1]])
    design = np.empty((len(root), 1 + linear.rank), order="F")
    design[:, 0] = root / np.sqrt(observations.effective_n)
    design[:, 1:] = (root * (basis.T @ regressors)).T
    slopes = linear.coefficients[1:].astype(float)
    at_mean = float(linear.coefficients[0] + linear.mean @ linear.coefficients[1:])
    return design, root * (observations.friction - at_mean - slopes @ regressors)


def in_coefficients(linear: LinearFit, covariance: FloatArray) -> FloatArray:
    """Covariance [3, 3] of the coefficients from one in the orthonormal design, plus the prior's part."""
    root = linear.root.astype(float)
    return np.asarray(root @ covariance @ root.T + linear.prior_covariance)
