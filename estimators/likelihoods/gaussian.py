"""Independent Gaussian errors: the likelihood reads a triangle of 4 × 4, whatever the number of samples behind it."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from estimators.defaults import PRIOR, REFERENCE, SAMPLING
from estimators.likelihoods.posterior import PosteriorSummary, Whitening, bounded_exp, corners, supported
from estimators.linear.fit_data import FitData
from estimators.linear.least_squares import whole_triangle
from estimators.linear.normal_inverse_gamma import NormalInverseGamma, exact_posterior
from estimators.linear.priors import positive_friction, prior_rows
from estimators.sampling.proposal import StudentMixture, standard

FloatArray = NDArray[np.float64]

NAMES = ("beta0", "beta1", "beta2", "sigma")


@dataclass(frozen=True, slots=True, eq=False)
class Gaussian:
    """Posterior of (β, σ) with the conjugate prior, cut off where μ ≤ 0 is expected in a corner of the data's domain.

    Whitened by the exact posterior without that cut: z = root⁻¹(β − mean)/σ is N(0, I), u = log σ standardised.
    ``rows`` [7, 4]: prior and data as rows in (1, v, f_n | μ), each with error σ; ``corners`` [4, 3] of the domain.
    """

    exact: NormalInverseGamma
    log_sigma: Whitening
    rows: FloatArray
    effective_n: float
    corners: FloatArray
    sampled: tuple[str, ...] = NAMES
    names: tuple[str, ...] = NAMES
    prior: str = positive_friction()
    proposal: StudentMixture = field(default_factory=lambda: standard(4))
    local: float = 0.0

    def log_probability(self, whitened: FloatArray) -> FloatArray:
        """Log posterior density [k]; the change of variables takes away what σ³ in β's prior adds."""
        beta, sigma = self._natural(whitened)
        misfit = beta @ self.rows[:, :3].T - self.rows[:, 3]
        square = np.einsum("ki,ki->k", misfit, misfit) + PRIOR.degrees_of_freedom * REFERENCE.scatter**2
        log = -(self.effective_n + PRIOR.degrees_of_freedom) * np.log(sigma) - 0.5 * square / sigma**2
        return supported(log, beta, self.corners)

    def summarise(self, whitened: FloatArray, _rng: np.random.Generator, /) -> PosteriorSummary:
        """Student-t of β from the draws: in z, which is independent of σ, its moments exist for any ν."""
        _, sigma = self._natural(whitened)
        scale = float(1.0 / np.sqrt(np.mean(sigma**-2.0)))
        root = scale * self.exact.root
        z = whitened[:, :3]
        kept = np.column_stack(self._natural(whitened[:: -(-len(whitened) // SAMPLING.kept_draws)]))
        return PosteriorSummary(
            coefficients=self.exact.mean + root @ z.mean(axis=0),
            covariance=root @ np.cov(z.T) @ root.T,
            scale=scale,
            degrees_of_freedom=self.exact.degrees_of_freedom,
            draws=kept,
            scatter_degrees_of_freedom=self.exact.degrees_of_freedom,
        )

    def _natural(self, whitened: FloatArray) -> tuple[FloatArray, FloatArray]:
        """β [k, 3] and σ [k]."""
        sigma = bounded_exp(self.log_sigma(whitened[:, 3:]))[:, 0]
        return self.exact.mean + sigma[:, None] * (whitened[:, :3] @ self.exact.root.T), sigma


def gaussian(data: FitData) -> Gaussian:
    """Posterior from the factor alone."""
    triangle, prior = whole_triangle(data.factor), prior_rows(data.element_area)
    exact = exact_posterior(data)
    centre, spread = exact.log_scale()
    return Gaussian(
        exact=exact,
        log_sigma=Whitening(np.array([centre]), np.array([[spread]])),
        rows=np.concatenate([prior, triangle.astype(float)]),
        effective_n=data.effective_n,
        corners=corners(data.domain),
    )
