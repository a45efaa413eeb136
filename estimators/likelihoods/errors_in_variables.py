"""Noise in the measured forces: regression of f_t on (f_n, v f_n, f_n²), without the ratio that noise in f_n spoils."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimators.defaults import IDENTIFIABILITY, PRIOR, PROPOSAL
from estimators.errors import InvalidSamples
from estimators.likelihoods.kernels import sum_log_normal
from estimators.likelihoods.per_sample import PerSample, Rows, per_sample
from estimators.likelihoods.posterior import bounded_exp
from estimators.linear.fit_data import FitData
from estimators.linear.priors import log_half_student

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class ErrorsInVariables:
    """Of (σ, s): s in N is the noise of each component of the force on an element, and may be near 0.

    The true f_n are taken as normal with the mean ``mean`` and variance ``variance`` − s², which gives each its
    expectation and variance from what was measured (regression calibration; Carroll et al., 2006, §4 and §8).

    Coordinates (log R, x): R² = σ² + ``gain``² s² is the scatter of the measured ratio, well determined;
    x² = ``gain`` s/σ, the share of the noise in it, is not. Few samples leave an arc between σ = 0 and s = 0,
    which is straight in these; the root bends the density to 0 where s ends. ``gain``: that of s in the ratio, 1/N.
    """

    mean: float
    variance: float
    gain: float
    noise_scale: float
    prior: str
    names: tuple[str, ...] = ("sigma", "force_noise")

    def start(self, scale: float) -> FloatArray:
        """The robust scale, half of its square noise, but noise well within the variation of f_n."""
        noise = min(float(np.sqrt(0.5)) * scale, PROPOSAL.start_noise * self.gain * float(np.sqrt(self.variance)))
        root = float(np.sqrt(noise / np.sqrt(scale**2 - noise**2)))
        return np.array([[np.log(scale), root], [PROPOSAL.start_spread, PROPOSAL.start_noise_spread * root]])

    def natural(self, coordinates: FloatArray) -> FloatArray:
        """(σ, s)."""
        ratio = np.clip(coordinates[:, 1], 0.0, PROPOSAL.largest_root) ** 2
        sigma = bounded_exp(coordinates[:, 0]) / np.hypot(1.0, ratio)
        return np.column_stack([sigma, ratio * sigma / self.gain])

    def log_prior(self, coordinates: FloatArray) -> FloatArray:
        """That of s; none where noise would exceed all the variation of the measured f_n.

        ∂(log σ, s)/∂(log R, x) is 2 x σ/``gain``.
        """
        root = coordinates[:, 1]
        sigma, noise = self.natural(coordinates).T
        inside = (root > 0.0) & (noise**2 < PRIOR.most_noise * self.variance)
        log = log_half_student(noise, self.noise_scale) + np.log(np.where(inside, root, 1.0) * sigma)
        return np.where(inside, log, -np.inf)

    def log_likelihood(self, beta: FloatArray, natural: FloatArray, rows: Rows) -> FloatArray:
        """Sum of w log N(f_t; its mean given what was measured, scatter and noise together)."""
        moments = np.array([self.mean, self.variance])
        return sum_log_normal(beta, natural**2, moments, rows.v, rows.f_n, rows.tangential_force, rows.weight)

    def scatter_degrees_of_freedom(self, natural: FloatArray, otherwise: float) -> float:
        """That of σ: the prediction is for the true f_n."""
        return otherwise if natural.size else 1.0


def errors_in_variables(data: FitData) -> PerSample:
    """Posterior of (β, σ, force noise)."""
    observations = data.raw("bayes, errors_in_variables")
    f_n, weight = observations.normal_force, observations.weight
    mean = float(np.average(f_n, weights=weight))
    variance = float(np.average((f_n - mean) ** 2, weights=weight))
    if variance <= (2.0 * IDENTIFIABILITY.rounding * np.finfo(float).eps * mean) ** 2:
        raise InvalidSamples("normal_force", f"{mean:.6g} N in every sample", "forces that vary, as noisy ones do")
    size = float(np.sqrt(np.average(f_n**2, weights=weight)))
    friction = float(np.average(observations.tangential_force, weights=weight)) / mean
    scale = PRIOR.force_noise * size
    terms = ErrorsInVariables(
        mean=mean,
        variance=variance,
        gain=float(np.hypot(1.0, friction)) / size,
        noise_scale=scale,
        prior=f"noise of a force component ~ half-Student-t with scale {scale:.3g} N",
    )
    return per_sample(data, terms, "errors_in_variables")
