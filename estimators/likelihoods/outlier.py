"""Gaussian errors with a part of outliers: elements taken for slipping that stick show too little friction."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimators.likelihoods.kernels import sum_log_mixture
from estimators.likelihoods.per_sample import PerSample, Rows, per_sample
from estimators.likelihoods.posterior import bounded_exp
from estimators.linear.fit_data import FitData

FloatArray = NDArray[np.float64]

CLEAN = 4.0
"""Part of outliers π ~ Beta(1, 4) below ½: a sixth of the samples on average, and none at all as likely as any.

A majority would not be outliers: the two components would trade places, at a plane that is the prior's own.
"""
RATIO = (6.0, 0.5)
"""Scatter of outliers over that of the rest, less 1: log-normal about 6, as outliers as narrow as the rest are none."""
OFFSET = (-0.1, 0.2)
"""Mean of the outliers' residuals, normal: below the plane, as false slip is."""


@dataclass(frozen=True, slots=True, eq=False)
class Outlier:
    """Coordinates (log σ, π^⅓, log κ, δ): of the outliers, part π, scatter σ(1 + κ) and mean residual δ.

    π^⅓ is close to normal even where there are no outliers and π follows an exponential law (Wilson & Hilferty).
    """

    names: tuple[str, ...] = ("sigma", "outlier_part", "outlier_scatter", "outlier_offset")
    prior: str = (
        f"part of outliers ~ Beta(1, {CLEAN:g}) below 1/2; their scatter sigma (1 + kappa), "
        f"log kappa ~ N(log {RATIO[0]:g}, {RATIO[1]:g}^2); their mean residual ~ N({OFFSET[0]:g}, {OFFSET[1]:g}^2)"
    )

    def start(self, scale: float) -> FloatArray:
        """The robust scale, and the middle of the priors."""
        return np.array([[np.log(scale), 0.4, np.log(RATIO[0]), OFFSET[0]], [0.1, 0.1, RATIO[1], 0.1]])

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
        log = 2.0 * np.log(part) + (CLEAN - 1.0) * np.log1p(-(part**3))
        log -= 0.5 * ((log_ratio - np.log(RATIO[0])) / RATIO[1]) ** 2 + 0.5 * ((offset - OFFSET[0]) / OFFSET[1]) ** 2
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
