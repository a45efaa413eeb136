"""What a friction model needs of the hierarchical posterior: coefficients and scales, each with a Student-t's tails."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import special

from estimators.defaults import IDENTIFIABILITY
from estimators.friction_model import Scale, Scales, SensorFriction, SensorScale
from estimators.linear.normal_mixture import Student, matched_student, mixture_quantile
from estimators.linear.posterior_grid import ScaleNodes
from estimators.linear.priors import ScatterPrior
from estimators.linear.sensor_gains import Gains

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
    found = _coefficients(nodes, at)
    sigma, tau, omega, *kappa = nodes.scatter.T
    zero = np.zeros(len(sigma))
    grasps, places, within = (Scale(*matched_student(nodes.weight, zero, scale)) for scale in (tau, omega, sigma))
    scales = Scales(grasps, places, within)
    friction = at @ found.mean
    together = np.sqrt((tau * friction) ** 2 + omega**2 + sigma**2)
    if nodes.gains is not None:
        scale = Scale(*matched_student(nodes.weight, zero, kappa[0]))
        scales = replace(scales, between_sensors=SensorScale(scale, _sensors(nodes, nodes.gains, at)))
        together = np.hypot(together, kappa[0] * friction)
    return MixtureSummary(
        coefficients=found.mean,
        covariance=found.covariance,
        degrees_of_freedom=found.degrees_of_freedom,
        scales=scales,
        scatter=matched_student(nodes.weight, zero, together),
    )


class _Coefficients(NamedTuple):
    mean: FloatArray
    covariance: FloatArray
    degrees_of_freedom: float


def _coefficients(nodes: ScaleNodes, at: FloatArray) -> _Coefficients:
    mean, covariance = nodes.moments()
    away = nodes.mean - mean
    expected = matched_student(nodes.weight, away @ at, np.sqrt(np.einsum("kij,i,j->k", nodes.covariance, at, at)))
    freedom = expected.degrees_of_freedom
    return _Coefficients(mean, _widened(covariance, nodes, away, freedom), freedom)


def _sensors(nodes: ScaleNodes, gains: Gains, at: FloatArray) -> dict[str, SensorFriction]:
    """What each sensor shows: (1 + s) β along the mean of β, s and β normal together at each node."""
    law = nodes.weight @ nodes.mean
    sigma, tau, omega = nodes.scatter.T[:3]
    found = {}
    for place, name in enumerate(gains.names):
        own = gains.of(place)
        shared = own.with_coefficients[:, :, None] * law
        spread = nodes.covariance + shared + shared.swapaxes(1, 2) + own.variance[:, None, None] * np.outer(law, law)
        of_it = _coefficients(nodes._replace(mean=nodes.mean + own.mean[:, None] * law, covariance=spread), at)
        together = np.sqrt((tau * (at @ of_it.mean)) ** 2 + omega**2 + sigma**2)
        scatter = matched_student(nodes.weight, np.zeros(len(sigma)), together)
        gain, variance = own.moments(nodes.weight)
        found[name] = SensorFriction(
            gain=gain,
            standard_error=float(np.sqrt(variance)),
            coefficients=tuple(of_it.mean.tolist()),
            covariance=tuple(tuple(row) for row in of_it.covariance.tolist()),
            degrees_of_freedom=of_it.degrees_of_freedom,
            scale=scatter.scale,
            scatter_degrees_of_freedom=scatter.degrees_of_freedom,
        )
    return found


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
