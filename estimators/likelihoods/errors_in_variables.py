"""Noise in the measured forces: regression of f_t on (f_n, v f_n, f_n²), without the ratio that noise in f_n spoils."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimators.errors import InvalidSamples
from estimators.evidence import Evidence
from estimators.likelihoods.kernels import sum_log_normal
from estimators.likelihoods.per_sample import PerSample, Rows, per_sample
from estimators.likelihoods.posterior import bounded_exp
from estimators.priors import log_half_student

FloatArray = NDArray[np.float64]

NOISE = 0.05
"""Scale of the half-Student-t prior of the force noise, in parts of the root mean square of f_n."""


@dataclass(frozen=True, slots=True, eq=False)
class ErrorsInVariables:
    """Coordinates (log σ, s): s in N is the noise of each component of the force on an element, and may be near 0.

    The true f_n are taken as normal with the mean ``mean`` and variance ``variance`` − s², which gives each its
    expectation and variance from what was measured (regression calibration; Carroll et al., 2006, §4 and §8).
    """

    mean: float
    variance: float
    noise_scale: float
    prior: str
    names: tuple[str, ...] = ("sigma", "force_noise")

    def start(self, scale: float) -> FloatArray:
        """The robust scale, and noise well within the variation of f_n."""
        noise = min(0.4 * self.noise_scale, 0.3 * float(np.sqrt(self.variance)))
        return np.array([[np.log(scale), noise], [0.1, 0.2 * noise]])

    def natural(self, coordinates: FloatArray) -> FloatArray:
        """(σ, s)."""
        return np.column_stack([bounded_exp(coordinates[:, 0]), coordinates[:, 1]])

    def log_prior(self, coordinates: FloatArray) -> FloatArray:
        """That of s; none where noise would exceed all the variation of the measured f_n."""
        noise = coordinates[:, 1]
        inside = (noise > 0.0) & (noise**2 < 0.98 * self.variance)
        return np.where(inside, log_half_student(noise, self.noise_scale), -np.inf)

    def log_likelihood(self, beta: FloatArray, natural: FloatArray, rows: Rows) -> FloatArray:
        """Sum of w log N(f_t; its mean given what was measured, scatter and noise together)."""
        moments = np.array([self.mean, self.variance])
        return sum_log_normal(beta, natural**2, moments, rows.v, rows.f_n, rows.tangential_force, rows.weight)

    def scatter_degrees_of_freedom(self, natural: FloatArray, otherwise: float) -> float:
        """That of σ: the prediction is for the true f_n."""
        return otherwise if natural.size else 1.0


def errors_in_variables(evidence: Evidence) -> PerSample:
    """Posterior of (β, σ, force noise)."""
    observations = evidence.raw("bayes, errors_in_variables")
    f_n, weight = observations.normal_force, observations.weight
    mean = float(np.average(f_n, weights=weight))
    variance = float(np.average((f_n - mean) ** 2, weights=weight))
    if variance <= (16.0 * np.finfo(float).eps * mean) ** 2:
        raise InvalidSamples("normal_force", f"{mean:.6g} N in every sample", "forces that vary, as noisy ones do")
    scale = NOISE * float(np.sqrt(np.average(f_n**2, weights=weight)))
    terms = ErrorsInVariables(
        mean=mean,
        variance=variance,
        noise_scale=scale,
        prior=f"noise of a force component ~ half-Student-t with scale {scale:.3g} N",
    )
    return per_sample(evidence, terms, "errors_in_variables")
