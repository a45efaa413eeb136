"""The orthonormal design behind a least-squares fit, in which covariances are simple and nothing is lost."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from estimators.defaults import LINEAR
from estimators.linear.least_squares import LinearFit
from estimators.linear.observations import IntArray, Observations

FloatArray = NDArray[np.float64]


def orthonormal(observations: Observations, linear: LinearFit) -> tuple[FloatArray, FloatArray]:
    """Orthonormal design Q [n, r] and residuals [n], both times √w."""
    return _rows(observations, linear, observations.effective_n, slice(None))


def orthonormal_blocks(
    observations: Observations, linear: LinearFit
) -> Iterator[tuple[FloatArray, FloatArray, IntArray]]:
    """The same with the cluster of each row, some rows at a time: as many as fit a cache, or as there are clusters."""
    size, effective_n = max(LINEAR.chunk, observations.clusters), observations.effective_n
    for start in range(0, len(observations), size):
        rows = slice(start, start + size)
        yield *_rows(observations, linear, effective_n, rows), observations.cluster[rows]


def _rows(
    observations: Observations, linear: LinearFit, effective_n: float, rows: slice
) -> tuple[FloatArray, FloatArray]:
    root = np.sqrt(observations.weight[rows])
    mean, basis = linear.mean.astype(float), linear.basis.astype(float)
    v, f_n = observations.tangential_velocity[rows], observations.normal_force[rows]
    regressors = np.stack([v - mean[0], f_n - mean[1]])
    design = np.empty((len(root), 1 + linear.rank), order="F")
    design[:, 0] = root / np.sqrt(effective_n)
    design[:, 1:] = (root * (basis.T @ regressors)).T
    slopes = linear.coefficients[1:].astype(float)
    at_mean = float(linear.coefficients[0] + linear.mean @ linear.coefficients[1:])
    return design, root * (observations.friction[rows] - at_mean - slopes @ regressors)


def in_coefficients(linear: LinearFit, covariance: FloatArray) -> FloatArray:
    """Covariance [3, 3] of the coefficients from one in the orthonormal design, plus the prior's part."""
    root = linear.root.astype(float)
    return np.asarray(root @ covariance @ root.T + linear.prior_covariance)
