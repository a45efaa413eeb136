"""Ordinary (weighted) least squares with errors that hold when samples of one grasp or element move together."""

import time
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from estimators.defaults import LINEAR, REFERENCE
from estimators.friction_model import FrictionModel
from estimators.likelihoods.posterior import PosteriorSummary
from estimators.linear.cluster_errors import cluster_sums
from estimators.linear.coefficient_errors import CoefficientErrors, clustered_errors, of_any_grasp
from estimators.linear.fit_data import FitData
from estimators.linear.least_squares import LinearFit, solve
from estimators.linear.observations import IntArray
from estimators.linear.orthonormal import in_coefficients, orthonormal, orthonormal_blocks
from estimators.linear.priors import WEAK
from estimators.methods.reporting import Diagnostics, by_coefficient, report

FloatArray = NDArray[np.float64]
Rows = tuple[FloatArray, FloatArray, IntArray]


def fit(data: FitData) -> FrictionModel:
    """Least squares of μ on (1, v, f_n), weighted, with CR2 errors and Satterthwaite's degrees of freedom.

    Clusters are grasps where there are two or more, else elements, else stretches of time; the moments of a single
    grasp know of none, and errors are then taken to be independent. The noise of μ = f_t/f_n grows as 1/f_n: errors
    from the clusters allow for it, the classical errors in the diagnostics do not.
    """
    begin = time.perf_counter()
    linear = solve(data.factor, REFERENCE.spans(data.element_area))
    residual_degrees = data.effective_n - 1.0 - linear.rank
    scale = float(linear.residual_norm / np.sqrt(residual_degrees))
    errors = _errors(data, linear, scale, residual_degrees)
    diagnostics: Diagnostics = {
        "r_squared": r_squared(data.factor.triangle, linear.residual_norm),
        **by_coefficient("standard_error_classical", np.sqrt(np.diag(classical(linear, scale)))),
        **_of_clusters(data, linear, errors),
    }
    if data.of_one_grasp:
        errors = of_any_grasp(errors, linear.coefficients)
        diagnostics |= {"prior": f"between grasps {WEAK}"}
    found = PosteriorSummary(linear.coefficients, errors.covariance, scale, errors.degrees_of_freedom, residual_degrees)
    return report(data, "ols", found, begin, diagnostics, linear)


def classical(linear: LinearFit, scale: float) -> FloatArray:
    """Covariance [3, 3] if all errors were independent and alike."""
    return in_coefficients(linear, scale**2 * np.eye(linear.rank + 1))


def r_squared(triangle: NDArray[np.floating], residual_norm: float) -> float:
    """Part of the weighted variance of μ that the plane explains; 0 where μ does not vary."""
    total = float(np.sqrt(np.sum(np.square(triangle[:, -1]))))
    return 1.0 - (residual_norm / total) ** 2 if total > 0.0 else 0.0


def _errors(data: FitData, linear: LinearFit, scale: float, residual_degrees: float) -> CoefficientErrors:
    """Errors from the clusters where there are any, else those of independent samples."""
    if data.clusters < 2:
        covariance = classical(linear, scale)
        degrees = np.full(3, residual_degrees)
        return CoefficientErrors(covariance, residual_degrees, degrees, np.sqrt(np.diag(covariance)))
    seen = data.observations
    blocks: Iterable[Rows] = [_of_blocks(data, linear)] if seen is None else orthonormal_blocks(seen, linear)
    return clustered_errors(linear, *cluster_sums(blocks, data.clusters), scale, residual_degrees)


def _of_clusters(data: FitData, linear: LinearFit, errors: CoefficientErrors) -> Diagnostics:
    """The errors by coefficient, and what statsmodels says beside them."""
    if data.clusters < 2:
        return {}
    found = by_coefficient("standard_error_cluster", errors.standard)
    found |= by_coefficient("degrees_of_freedom", errors.degrees)
    observations = data.observations
    if observations is not None and len(observations) <= LINEAR.statsmodels:
        found |= _statsmodels_errors(*orthonormal(observations, linear), observations.cluster, linear)
    return found


def _of_blocks(data: FitData, linear: LinearFit) -> Rows:
    """The same from moments: four rows a grasp that have the sums of squares and products of all its samples."""
    rows = data.centred_rows()
    basis = linear.basis.astype(float)
    design = np.concatenate([rows[..., :1] / np.sqrt(data.effective_n), rows[..., 1:3] @ basis], axis=-1)
    residual = rows[..., 3] - rows[..., 1:3] @ linear.coefficients[1:].astype(float)
    cluster = np.repeat(np.arange(len(rows)), rows.shape[1])
    return design.reshape(len(cluster), -1), residual.reshape(-1), cluster


def _statsmodels_errors(design: FloatArray, residual: FloatArray, cluster: IntArray, linear: LinearFit) -> Diagnostics:
    """HC3 and CR1 errors by statsmodels, on the orthonormal design, where nothing can fail silently."""
    from statsmodels.regression.linear_model import OLS  # takes more than a second to load

    results = OLS(residual, design).fit()
    clustered = results.get_robustcov_results("cluster", groups=cluster)
    return {
        **by_coefficient("standard_error_hc3", np.sqrt(np.diag(in_coefficients(linear, results.cov_HC3)))),
        **by_coefficient("standard_error_cr1", np.sqrt(np.diag(in_coefficients(linear, clustered.cov_params())))),
    }
