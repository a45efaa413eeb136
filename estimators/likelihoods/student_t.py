"""Student-t errors with free degrees of freedom: heavy tails on both sides."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import special

from estimators.likelihoods.kernels import sum_log1p_square
from estimators.likelihoods.per_sample import PerSample, Rows, per_sample
from estimators.likelihoods.posterior import bounded_exp
from estimators.linear.fit_data import FitData

FloatArray = NDArray[np.float64]

SHAPE, RATE = 2.0, 0.1
"""Gamma prior of ν (Juárez & Steel, 2010, J. Bus. Econ. Stat. 28:52): mean 20, heavy and light tails both allowed."""


@dataclass(frozen=True, slots=True, eq=False)
class StudentT:
    """Coordinates (log σ, log ν)."""

    names: tuple[str, ...] = ("sigma", "nu")
    prior: str = f"nu ~ Gamma({SHAPE:g}, rate {RATE:g})"

    def start(self, scale: float) -> FloatArray:
        """The robust scale, and moderate tails."""
        return np.array([[np.log(scale), np.log(6.0)], [0.1, 0.5]])

    def natural(self, coordinates: FloatArray) -> FloatArray:
        """(σ, ν)."""
        return bounded_exp(coordinates)

    def log_prior(self, coordinates: FloatArray) -> FloatArray:
        """That of log ν."""
        return np.asarray(SHAPE * coordinates[:, 1] - RATE * bounded_exp(coordinates[:, 1]))

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
