"""A random intercept per grasp: β and the intercepts are integrated out exactly, emcee walks on two scatters only."""

from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import special

from estimators.defaults import PRIOR, REFERENCE, SAMPLING
from estimators.likelihoods.posterior import Summary, bounded_exp, scatter
from estimators.linear.fit_data import FitData
from estimators.linear.normal_inverse_gamma import NormalInverseGamma, exact_posterior
from estimators.linear.priors import log_half_student, prior_rows, structured
from estimators.sampling.normal_score import NormalScore, normal_score
from estimators.sampling.proposal import StudentMixture, standard

FloatArray = NDArray[np.float64]


class _Given(NamedTuple):
    """What follows from λ [k]: residual square, mean [k, 3] and precision [k, 3, 3] of γ, log normalisation."""

    square: FloatArray
    gamma: FloatArray
    precision: FloatArray
    log_weight: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class GraspEffects:
    """Posterior of (σ, τ) of ``μ = x β + u_g + ε``, u_g ~ N(0, τ²), ε ~ N(0, σ²), with all else integrated out.

    Given λ = τ²/σ², what a cluster of weight W_g says of β through its mean shrinks by 1/(1 + λ W_g); what it says
    through the spread about its mean does not change (Lindley & Smith, 1972). In coordinates γ in which the pooled fit
    is (0, I): ``weight`` [g]; ``between`` [g, 4, 4] outer products of the means' rows (x | residual), times W_g;
    ``fixed`` [4, 4] those of prior and spread within; ``pooled``: β = mean + root γ.

    Whitened by what is known in closed form: σ² given λ is inverse-gamma, were it not for the prior of τ, and log λ is
    a ``score`` of a standard normal that follows its own marginal, however skewed where there is no effect at all.
    """

    weight: FloatArray
    between: FloatArray
    fixed: FloatArray
    effective_n: float
    pooled: NormalInverseGamma
    score: NormalScore
    sampled: tuple[str, ...] = ("log_sigma", "log_tau")
    names: tuple[str, ...] = ("beta0", "beta1", "beta2", "sigma", "tau")
    prior: str = structured()
    proposal: StudentMixture = field(default_factory=lambda: standard(2))
    local: float = 0.0

    def log_probability(self, whitened: FloatArray) -> FloatArray:
        """Log posterior density [k] in whitened coordinates."""
        log_ratio, log_slope = self.score(whitened[:, 1])
        given = self._given(bounded_exp(log_ratio))
        return self._log_density(self._log_sigma(given, whitened[:, 0]), log_ratio, given) + log_slope

    def log_density(self, sigma: FloatArray, tau: FloatArray) -> FloatArray:
        """Log posterior density [k] of (log σ, log τ), up to a constant."""
        ratio = np.square(tau / sigma)
        return self._log_density(np.log(sigma), np.log(ratio), self._given(ratio))

    def log_marginal(self, log_ratio: FloatArray) -> FloatArray:
        """Log density [k] of log λ with σ integrated out, the prior of τ taken at the σ then expected."""
        given = self._given(bounded_exp(log_ratio))
        log_sigma = self._log_sigma(given, np.zeros(len(log_ratio)))
        degrees = self.effective_n + PRIOR.degrees_of_freedom
        prior = log_half_student(bounded_exp(log_sigma + 0.5 * log_ratio), REFERENCE.scatter)
        return np.asarray(given.log_weight - 0.5 * degrees * np.log(given.square) + prior + 0.5 * log_ratio)

    def summarise(self, whitened: FloatArray, rng: np.random.Generator, /) -> Summary:
        """β given each (σ, τ) is exactly normal: its mean and covariance need no draws of it."""
        kept = whitened[:: -(-len(whitened) // SAMPLING.kept_draws)]
        log_ratio = self.score(kept[:, 1])[0]
        given = self._given(bounded_exp(log_ratio))
        sigma = bounded_exp(self._log_sigma(given, kept[:, 0]))
        tau = sigma * bounded_exp(0.5 * log_ratio)
        gamma, spread = given.gamma, np.linalg.cholesky(np.linalg.inv(given.precision)) * sigma[:, None, None]
        normal = rng.standard_normal((len(kept), 3, 1))
        covariance = np.mean(spread @ spread.transpose(0, 2, 1), axis=0) + np.cov(gamma.T)
        scale, degrees = scatter(sigma**2 + tau**2)
        centre, root = self.pooled.mean, self.pooled.root
        return Summary(
            coefficients=centre + root @ gamma.mean(axis=0),
            covariance=root @ covariance @ root.T,
            scale=scale,
            degrees_of_freedom=max(min(len(self.weight) - 1.0, self.effective_n - 3.0), 1.0),
            scatter_degrees_of_freedom=min(degrees, self.effective_n),
            draws=np.column_stack([centre + (gamma + (spread @ normal)[..., 0]) @ root.T, sigma, tau]),
        )

    def _given(self, ratio: FloatArray) -> _Given:
        """All that follows from λ [k]; γ's normal matrix is close to I, so that nothing is lost by forming it."""
        shrinkage = 1.0 / (1.0 + ratio[:, None] * self.weight)
        normal = self.fixed + (shrinkage @ self.between.reshape(len(self.weight), 16)).reshape(-1, 4, 4)
        precision = normal[:, :3, :3]
        gamma = np.linalg.solve(precision, normal[:, :3, 3:])[..., 0].astype(float)
        square = normal[:, 3, 3] - np.einsum("ki,ki->k", gamma, normal[:, :3, 3])
        log_weight = 0.5 * np.log(shrinkage).sum(axis=1) - 0.5 * np.linalg.slogdet(precision)[1]
        return _Given(
            square.astype(float) + PRIOR.degrees_of_freedom * REFERENCE.scatter**2, gamma, precision, log_weight
        )

    def _log_sigma(self, given: _Given, standard: FloatArray) -> FloatArray:
        """log σ [k] from a standard normal, by mean and spread of the inverse-gamma that σ² follows given λ."""
        shape = 0.5 * (self.effective_n + PRIOR.degrees_of_freedom)
        mean = 0.5 * (np.log(0.5 * given.square) - special.digamma(shape))
        return np.asarray(mean + 0.5 * np.sqrt(special.polygamma(1, shape)) * standard)

    def _log_density(self, log_sigma: FloatArray, log_ratio: FloatArray, given: _Given) -> FloatArray:
        log_tau = log_sigma + 0.5 * log_ratio
        misfit = 0.5 * given.square / np.square(bounded_exp(log_sigma))
        log = given.log_weight - (self.effective_n + PRIOR.degrees_of_freedom) * log_sigma - misfit
        return np.asarray(log + log_half_student(bounded_exp(log_tau), REFERENCE.scatter) + log_tau)


def grasp_effects(data: FitData) -> GraspEffects:
    """Posterior from each cluster's weight and mean, and the spread within clusters."""
    prior, pooled, means = prior_rows(data.element_area), exact_posterior(data), data.cluster_means()
    fixed = _rows(np.concatenate([prior, means.within]), pooled)
    between = _rows(np.column_stack([np.ones(len(means.weight)), means.mean]), pooled)
    effects = GraspEffects(
        weight=means.weight,
        between=means.weight[:, None, None] * between[:, :, None] * between[:, None, :],
        fixed=fixed.T @ fixed,
        effective_n=data.effective_n,
        pooled=pooled,
        score=NormalScore(np.array([-1.0, 1.0]), np.array([-1.0, 1.0])),
    )
    expected = 2.0 * np.log(REFERENCE.scatter / pooled.scale)  # log λ at the prior's scale of τ
    lowest = min(-np.log(means.weight.max()), expected) - 16.0  # 1/3000 of what a cluster's mean could show
    highest = max(expected, 0.0) + 16.0
    return replace(effects, score=normal_score(effects.log_marginal, lowest, highest))


def _rows(rows: FloatArray, pooled: NormalInverseGamma) -> FloatArray:
    """Rows in (1, v, f_n | μ) as rows in (γ | residual of the pooled fit)."""
    return np.column_stack([rows[:, :3] @ pooled.root, rows[:, 3] - rows[:, :3] @ pooled.mean])
