"""Independent Gaussian errors: the likelihood reads a triangle of 4 × 4, whatever the number of samples behind it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimators.conjugate import NormalInverseGamma, posterior, prior_rows, whole_triangle
from estimators.defaults import PRIOR, REFERENCE
from estimators.friction_model import Domain
from estimators.least_squares import Factor
from estimators.likelihoods.posterior import Summary

FloatArray = NDArray[np.float64]

NAMES = ("beta0", "beta1", "beta2", "sigma")


@dataclass(frozen=True, slots=True, eq=False)
class Gaussian:
    """Posterior of (β, σ) with the conjugate prior, cut off where μ ≤ 0 is expected in a corner of the data's domain.

    Whitened by the exact posterior without that cut: z = root⁻¹(β − mean)/σ is N(0, I), u = log σ standardised.
    ``rows`` [7, 4]: prior and data as rows in (1, v, f_n | μ), each with error σ; ``corners`` [4, 3] of the domain.
    """

    exact: NormalInverseGamma
    rows: FloatArray
    effective_n: float
    corners: FloatArray

    @property
    def names(self) -> tuple[str, ...]:
        """β₀, β₁, β₂, σ."""
        return NAMES

    def natural(self, whitened: FloatArray) -> FloatArray:
        """(β, σ), [k, 4]."""
        centre, spread = self.exact.log_scale()
        sigma = np.exp(np.clip(centre + spread * whitened[:, 3], -300.0, 300.0))
        beta = self.exact.mean + sigma[:, None] * (whitened[:, :3] @ self.exact.root.T)
        return np.column_stack([beta, sigma])

    def log_probability(self, whitened: FloatArray) -> FloatArray:
        """Log posterior density [k]; the change of variables takes away what σ³ in β's prior adds."""
        parameters = self.natural(whitened)
        beta, sigma = parameters[:, :3], parameters[:, 3]
        misfit = beta @ self.rows[:, :3].T - self.rows[:, 3]
        square = np.einsum("ki,ki->k", misfit, misfit) + PRIOR.degrees_of_freedom * REFERENCE.scatter**2
        log = -(self.effective_n + PRIOR.degrees_of_freedom) * np.log(sigma) - 0.5 * square / sigma**2
        return np.where((beta @ self.corners.T > 0.0).all(axis=1), log, -np.inf)

    def summarise(self, whitened: FloatArray) -> Summary:
        """Student-t of β from the draws: in z, which is independent of σ, its moments exist for any ν."""
        sigma = self.natural(whitened)[:, 3]
        scale = float(1.0 / np.sqrt(np.mean(sigma**-2.0)))
        root = scale * self.exact.root
        z = whitened[:, :3]
        covariance = root @ np.cov(z.T) @ root.T
        return Summary(self.exact.mean + root @ z.mean(axis=0), covariance, scale, self.exact.degrees_of_freedom)


def gaussian(factor: Factor, domain: Domain, element_area: float) -> Gaussian:
    """Posterior from a factor of (v, f_n, μ) whose weight is the effective number of samples."""
    triangle, prior = whole_triangle(factor), prior_rows(element_area)
    rows = np.concatenate([prior, triangle.astype(float)])
    return Gaussian(posterior(triangle, factor.weight, prior), rows, factor.weight, corners(domain))


def corners(domain: Domain) -> FloatArray:
    """The four corners (1, v, f_n) of the data's domain, [4, 3]."""
    return np.array([[1.0, v, f_n] for v in domain.tangential_velocity for f_n in domain.normal_force])
