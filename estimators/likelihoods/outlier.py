"""Gaussian errors with a part of outliers: elements taken for slipping that stick show too little friction."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimators.defaults import PRIOR, PROPOSAL
from estimators.likelihoods.kernels import sum_log_mixture
from estimators.likelihoods.per_sample import PerSample, Rows, per_sample
from estimators.likelihoods.posterior import bounded_exp
from estimators.linear.fit_data import FitData

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Outlier:
    """Coordinates (log σ, π^⅓, log κ, δ): of the outliers, part π, scatter σ(1 + κ) and mean residual δ.

    π^⅓ is close to normal even where there are no outliers and π follows an exponential law (Wilson & Hilferty).
    """

    names: tuple[str, ...] = ("sigma", "outlier_part", "outlier_scatter", "outlier_offset")
    prior: str = (
        f"part of outliers ~ Beta(1, {PRIOR.clean:g}) below 1/2; their scatter sigma (1 + kappa), log kappa ~ "
        f"N(log {PRIOR.outlier_ratio:g}, {PRIOR.outlier_ratio_spread:g}^2); their mean residual ~ "
        f"N({PRIOR.outlier_offset:g}, {PRIOR.outlier_offset_spread:g}^2)"
    )

    def start(self, scale: float) -> FloatArray:
        """The robust scale, and the middle of the priors."""
        spread = PROPOSAL.start_spread
        return np.array(
            [
                [np.log(scale), PROPOSAL.start_part, np.log(PRIOR.outlier_ratio), PRIOR.outlier_offset],
                [spread, spread, PRIOR.outlier_ratio_spread, spread],
            ]
        )

    def natural(self, coordinates: FloatArray) -> FloatArray:
        """(σ, π, σ(1 + κ), δ)."""
        sigma, ratio = bounded_exp(coordinates[:, 0]), bounded_exp(coordinates[:, 2])
        part = np.clip(coordinates[:, 1], 0.0, 1.0) ** 3
        return np.column_stack([sigma, part, sigma * (1.0 + ratio), coordinates[:, 3]])

    def log_prior(self, coordinates: FloatArray) -> FloatArray:
        """That of (π^⅓, log κ, δ); none outside 0 < π < ½."""
        _, root, log_ratio, offset = coordinates.T
        inside = (root > 0.0) & (root**3 < 0.5)
        part = np.where(inside, root, 0.5)
        log = 2.0 * np.log(part) + (PRIOR.clean - 1.0) * np.log1p(-(part**3))
        ratio = (log_ratio - np.log(PRIOR.outlier_ratio)) / PRIOR.outlier_ratio_spread
        log -= 0.5 * ratio**2 + 0.5 * ((offset - PRIOR.outlier_offset) / PRIOR.outlier_offset_spread) ** 2
        return np.where(inside, log, -np.inf)

    def log_likelihood(self, beta: FloatArray, natural: FloatArray, rows: Rows) -> FloatArray:
        """Sum of w log of the mixture, in logarithms: no sample is so far off that both components vanish."""
        sigma, part, wide, offset = natural.T
        near = np.column_stack([np.log1p(-part) - np.log(sigma), 0.5 / sigma**2])
        far = np.column_stack([np.log(part) - np.log(wide), 0.5 / wide**2, offset])
        return sum_log_mixture(beta, near, far, rows.v, rows.f_n, rows.friction, rows.weight)

    def scatter_degrees_of_freedom(self, natural: FloatArray, otherwise: float) -> float:
        """That of σ: a new slipping element is no outlier."""
        return otherwise if natural.size else 1.0


def outlier(data: FitData) -> PerSample:
    """Posterior of (β, σ, π, scatter and offset of outliers)."""
    return per_sample(data, Outlier(), "outlier")
