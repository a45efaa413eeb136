"""Student-t errors with free degrees of freedom: heavy tails on both sides."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import special

from estimators.defaults import PRIOR, PROPOSAL
from estimators.likelihoods.kernels import sum_log1p_square
from estimators.likelihoods.per_sample import PerSample, Rows, per_sample
from estimators.likelihoods.posterior import bounded_exp
from estimators.linear.fit_data import FitData

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class StudentT:
    """Coordinates (log σ, log ν)."""

    names: tuple[str, ...] = ("sigma", "nu")
    prior: str = f"nu ~ Gamma({PRIOR.nu_shape:g}, rate {PRIOR.nu_rate:g})"

    def start(self, scale: float) -> FloatArray:
        """The robust scale, and moderate tails."""
        return np.array([[np.log(scale), np.log(PROPOSAL.start_nu)], [PROPOSAL.start_spread, PROPOSAL.start_nu_spread]])

    def natural(self, coordinates: FloatArray) -> FloatArray:
        """(σ, ν)."""
        return bounded_exp(coordinates)

    def log_prior(self, coordinates: FloatArray) -> FloatArray:
        """That of log ν."""
        return np.asarray(PRIOR.nu_shape * coordinates[:, 1] - PRIOR.nu_rate * bounded_exp(coordinates[:, 1]))

    def log_likelihood(self, beta: FloatArray, natural: FloatArray, rows: Rows) -> FloatArray:
        """Sum of w log t_ν(r/σ)/σ."""
        sigma, nu = natural.T
        tails = sum_log1p_square(beta, 1.0 / (nu * sigma**2), rows.v, rows.f_n, rows.friction, rows.weight)
        constant = special.gammaln(0.5 * (nu + 1.0)) - special.gammaln(0.5 * nu) - 0.5 * np.log(nu) - np.log(sigma)
        return np.asarray(constant * rows.weight.sum() - 0.5 * (nu + 1.0) * tails)

    def scatter_degrees_of_freedom(self, natural: FloatArray, otherwise: float) -> float:
        """ν itself: the tails of a new observation."""
        return min(float(1.0 / np.mean(1.0 / natural[:, 1])), otherwise)


def student_t(data: FitData) -> PerSample:
    """Posterior of (β, σ, ν)."""
    return per_sample(data, StudentT(), "student_t")
