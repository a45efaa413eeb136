"""What a friction model needs of the hierarchical posterior: coefficients and scales, each with a Student-t's tails."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import special

from estimators.defaults import IDENTIFIABILITY
from estimators.friction_model import Scale, Scales
from estimators.linear.normal_mixture import Student, matched_student, mixture_quantile
from estimators.linear.posterior_grid import ScaleNodes
from estimators.linear.priors import ScatterPrior

FloatArray = NDArray[np.float64]


class MixtureSummary(NamedTuple):
    """``coefficients`` [3]; ``covariance`` [3, 3], the scale matrix of a Student-t on ``degrees_of_freedom`` whose 95 %
    intervals are the mixture's; ``scales``; ``scatter``: all of it together, for one element in a new grasp.
    """

    coefficients: FloatArray
    covariance: FloatArray
    degrees_of_freedom: float
    scales: Scales
    scatter: Student


def summarise(nodes: ScaleNodes, at: FloatArray) -> MixtureSummary:
    """Summary of nodes; the degrees of freedom are those of friction expected ``at`` (1, v, f_n), [3]."""
    mean, covariance = nodes.moments()
    away = nodes.mean - mean
    expected = matched_student(nodes.weight, away @ at, np.sqrt(np.einsum("kij,i,j->k", nodes.covariance, at, at)))
    sigma, tau, omega = nodes.scatter.T
    zero = np.zeros(len(sigma))
    scales = (Scale(*matched_student(nodes.weight, zero, scale)) for scale in (tau, omega, sigma))
    together = np.sqrt((tau * (at @ mean)) ** 2 + omega**2 + sigma**2)
    return MixtureSummary(
        coefficients=mean,
        covariance=_widened(covariance, nodes, away, expected.degrees_of_freedom),
        degrees_of_freedom=expected.degrees_of_freedom,
        scales=Scales(*scales),
        scatter=matched_student(nodes.weight, zero, together),
    )


def scatter_alone(nodes: ScaleNodes, scatter_prior: ScatterPrior) -> Scale:
    """The scale between grasps as the weak default prior would have left it: what the material shows by itself.

    The nodes' weights by the ratio of the priors (Hogg, Myers & Bovy, 2010, Astrophysical Journal 725:2166).
    """
    tau = nodes.scatter[:, 1]
    weight = nodes.weight * np.exp(ScatterPrior().log_density(tau) - scatter_prior.log_density(tau))
    return Scale(*matched_student(weight / weight.sum(), np.zeros(len(tau)), tau))


def _widened(covariance: FloatArray, nodes: ScaleNodes, away: FloatArray, degrees_of_freedom: float) -> FloatArray:
    """Scale matrix with the correlations of the covariance and, for each coefficient, the mixture's 95 % interval."""
    deviation = np.sqrt(np.diag(covariance))
    scale = np.empty(3)
    for k in range(3):
        half = _half_width(nodes.weight, away[:, k], np.sqrt(nodes.covariance[:, k, k]))
        scale[k] = half / special.stdtrit(degrees_of_freedom, IDENTIFIABILITY.ends[1])
    ratio = np.where(deviation > 0.0, scale / np.where(deviation > 0.0, deviation, 1.0), 0.0)
    return np.asarray(covariance * np.outer(ratio, ratio))


def _half_width(weight: FloatArray, mean: FloatArray, deviation: FloatArray) -> float:
    low, high = mixture_quantile(weight, mean, deviation, IDENTIFIABILITY.ends)
    return float(0.5 * (high - low))
