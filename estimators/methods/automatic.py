"""Which method the data call for, and why."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from estimators.defaults import AUTOMATIC, REFERENCE
from estimators.linear.fit_data import FitData
from estimators.linear.least_squares import solve
from estimators.linear.observations import Observations
from estimators.linear.shared_errors import plane, shared_by_elements
from estimators.methods import ols, robust

FloatArray = NDArray[np.float64]


class Choice(NamedTuple):
    """A method of ``fit``, the likelihood where it is "bayes", and the reason in words and numbers."""

    method: str
    likelihood: str | None
    reason: str


def choose(data: FitData) -> Choice:
    """The method for these data: noise in f_n first, then outliers, then how samples cluster.

    Noisy forces and outliers bias the coefficients, which no standard error makes good; clusters only widen them. Noise
    in the forces looks like outliers where f_n is small, hence its precedence. But the posteriors take the samples of
    an element as independent, and where they are not their intervals are far too narrow: a bias of a standard error
    does less harm.
    """
    observations = data.observations
    shared = 0.0
    if observations is not None:
        shared = shared_by_elements(data)
        noise, bias = force_noise(data, observations)
        if bias > AUTOMATIC.bias and not shared:
            reason = f"noise of about {noise:.2g} N in the forces shifts beta2 by {bias:.1f} of its standard errors"
            return Choice("bayes", "errors_in_variables", reason)
        part = float(robust.fit(data).diagnostics["downweighted"])
        if part > AUTOMATIC.downweighted and part * len(observations) >= AUTOMATIC.least_outliers:
            return Choice("robust", None, f"{part:.1%} of the samples lie far off the plane; normal errors leave 1.1%")
    if data.cluster_kind == "grasp" and shared:
        reason = f"samples of an element share {shared:.0%} of their errors' variance; grasps are the clusters"
        return Choice("ols", None, reason)
    if data.cluster_kind == "grasp":
        return Choice("bayes", "grasp_effects", f"{data.clusters} grasps, which may differ from each other")
    if data.clusters < 2:
        return Choice("conjugate", None, "moments of one grasp, which know of no clusters")
    reason = f"one grasp, errors shared within {data.clusters} clusters ({data.cluster_kind})"
    return Choice("ols", None, reason)


def force_noise(data: FitData, observations: Observations) -> tuple[float, float]:
    """Noise s of a force component (N) as the residuals show it, and the bias of β₂ that it makes, in standard errors.

    The variance of μ's residuals is σ² + s²(1 + μ²)/f_n²: weighted least squares of the squares on 1/f_n². The bias is
    that of a regressor with error, −β₂ s²/V, and of the ratio, whose error is −μ/f_n times that of f_n: −(μ/f_n) s²/V,
    with V the variance of f_n (Fuller, 1987, §1.1).
    """
    f_n, weight = observations.normal_force, observations.weight
    if f_n.min() <= 0.0 or np.ptp(f_n) == 0.0:
        return 0.0, 0.0
    linear = solve(data.factor, REFERENCE.spans(data.element_area))
    beta = linear.coefficients.astype(float)
    expected = plane(linear, observations)
    square = (observations.friction - expected) ** 2
    if not square.max() > 0.0:
        return 0.0, 0.0
    regressor = (1.0 + expected**2) / f_n**2
    typical = np.average(square, weights=weight) * np.maximum(regressor / np.average(regressor, weights=weight), 0.1)
    slope, error = _line(regressor, square, weight / typical**2)
    variance = float(np.average((f_n - np.average(f_n, weights=weight)) ** 2, weights=weight))
    if slope < AUTOMATIC.significance * error:
        return 0.0, 0.0
    attenuation = abs(beta[2] + np.average(expected, weights=weight) / np.average(f_n, weights=weight))
    standard_error = float(np.sqrt(ols.fit(data).covariance[2, 2]))
    return float(np.sqrt(slope)), float(attenuation * slope / variance / standard_error)


def _line(x: FloatArray, y: FloatArray, weight: FloatArray) -> tuple[float, float]:
    """Slope of y on x and its heteroscedasticity-robust standard error."""
    centre = x - np.average(x, weights=weight)
    square = float(weight @ centre**2)
    if square <= 0.0:
        return 0.0, np.inf
    slope = float((weight * centre) @ y) / square
    left = y - np.average(y, weights=weight) - slope * centre
    return slope, float(np.sqrt((weight * centre) ** 2 @ left**2)) / square
