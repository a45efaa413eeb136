"""Scatter between grasps, between places and within: emcee walks on the three scales, all else is integrated out."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from estimators.defaults import GRID, SAMPLING
from estimators.likelihoods.posterior import PosteriorSummary
from estimators.linear.fit_data import FitData
from estimators.linear.hierarchical import Products
from estimators.linear.mixture_summary import summarise
from estimators.linear.posterior_grid import PosteriorGrid, ScaleNodes, posterior_grid
from estimators.linear.priors import WEAK, ScatterPrior, structured
from estimators.sampling.normal_score import NormalScore, normal_score
from estimators.sampling.proposal import StudentMixture, standard

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class HierarchicalPosterior:
    """Posterior of (log σ, log τ, log ω), whose cost a point does not grow with the grasps behind it.

    The sums over grasps are tabulated by ``grid`` and interpolated between its nodes. Whitened: log λ = 2 log τ/σ and
    log ρ = 2 log ω/σ are ``scores`` of standard normals that follow their own marginals; log σ is standardised given
    them. ``at`` (1, v, f_n) [3] is where friction is summarised.
    """

    grid: PosteriorGrid
    scores: tuple[NormalScore, NormalScore]
    at: FloatArray
    prior: str
    sampled: tuple[str, ...] = ("log_sigma", "log_tau", "log_omega")
    names: tuple[str, ...] = ("beta0", "beta1", "beta2", "sigma", "tau", "omega")
    proposal: StudentMixture = field(default_factory=lambda: standard(3))
    local: float = 0.0

    def log_probability(self, whitened: FloatArray) -> FloatArray:
        """Log posterior density [k] in whitened coordinates; -inf outside the grid, where there is next to none."""
        (log_lambda, slope), (log_rho, other) = (
            score(column) for score, column in zip(self.scores, whitened[:, 1:].T, strict=True)
        )
        products = self.products(log_lambda, log_rho)
        centre, spread = self.grid.model.log_sigma(products)
        log_sigma = centre + spread * whitened[:, 0]
        log = self.grid.model.conditional(products, log_lambda, log_rho, log_sigma).log_density + slope + other
        return np.where(self._inside(log_lambda, log_rho), log, -np.inf)

    def products(self, log_lambda: FloatArray, log_rho: FloatArray) -> Products:
        """The sums over grasps at points [k]: polynomials between the grid's nodes, those at its edge beyond."""
        first, left = _taps(self.grid.log_lambda, log_lambda)
        second, right = _taps(self.grid.log_rho, log_rho)
        columns = len(self.grid.log_rho)
        node = (first[:, :, None] * columns + second[:, None, :]).reshape(len(first), -1)
        weight = (left[:, :, None] * right[:, None, :]).reshape(len(first), -1)
        square, log_determinant, unknown = self.grid.products
        return Products(
            np.einsum("kt,kti->ki", weight, square[node]),
            np.einsum("kt,kt->k", weight, log_determinant[node]),
            np.einsum("kt,kti->ki", weight, unknown[node]),
        )

    def nodes(self, whitened: FloatArray) -> ScaleNodes:
        """Draws [k, 3] as nodes of equal weight, with what is known of β given each."""
        log_lambda, log_rho = (score(column)[0] for score, column in zip(self.scores, whitened[:, 1:].T, strict=True))
        products = self.products(log_lambda, log_rho)
        centre, spread = self.grid.model.log_sigma(products)
        log_sigma = centre + spread * whitened[:, 0]
        given = self.grid.model.conditional(products, log_lambda, log_rho, log_sigma)
        sigma = np.exp(log_sigma)
        scatter = np.stack([sigma, sigma * np.exp(0.5 * log_lambda), sigma * np.exp(0.5 * log_rho)], axis=1)
        return ScaleNodes(np.full(len(sigma), 1.0 / len(sigma)), scatter, given.mean, given.covariance)

    def summarise(self, whitened: FloatArray, rng: np.random.Generator, /) -> PosteriorSummary:
        """β given each (σ, τ, ω) is exactly normal: its mean and covariance need no draws of it."""
        nodes = self.nodes(whitened[:: -(-len(whitened) // SAMPLING.kept_draws)])
        found = summarise(nodes, self.at)
        normal = rng.standard_normal((len(nodes.weight), 3, 1))
        beta = nodes.mean + (np.linalg.cholesky(nodes.covariance) @ normal)[..., 0]
        return PosteriorSummary(
            coefficients=found.coefficients,
            covariance=found.covariance,
            scale=found.scatter.scale,
            degrees_of_freedom=found.degrees_of_freedom,
            draws=np.column_stack([beta, nodes.scatter]),
            scatter_degrees_of_freedom=found.scatter.degrees_of_freedom,
            scales=found.scales,
        )

    def _inside(self, log_lambda: FloatArray, log_rho: FloatArray) -> NDArray[np.bool_]:
        lambdas, rhos = self.grid.log_lambda, self.grid.log_rho
        return np.asarray(
            (log_lambda >= lambdas[0]) & (log_lambda <= lambdas[-1]) & (log_rho >= rhos[0]) & (log_rho <= rhos[-1])
        )


def hierarchical(data: FitData, scatter_prior: ScatterPrior = WEAK) -> HierarchicalPosterior:
    """Posterior from each grasp's statistics by place."""
    grid = posterior_grid(data, scatter_prior)
    peak = grid.log_marginal.max()
    density = np.exp(grid.log_marginal - peak)
    scores = (
        _score(grid.log_lambda, np.log(density.sum(axis=1))),
        _score(grid.log_rho, np.log(density.sum(axis=0))),
    )
    return HierarchicalPosterior(grid=grid, scores=scores, at=data.mean_row(), prior=structured(scatter_prior))


def _score(nodes: FloatArray, log_density: FloatArray) -> NormalScore:
    return normal_score(lambda x: np.interp(x, nodes, log_density), float(nodes[0]), float(nodes[-1]))


def _taps(nodes: FloatArray, at: FloatArray) -> tuple[NDArray[np.int64], FloatArray]:
    """The ``taps`` equally spaced nodes about each point and their Lagrange weights, [k, taps] each."""
    step = nodes[1] - nodes[0]
    place = np.clip((at - nodes[0]) / step, 0.0, len(nodes) - 1.0)
    start = np.clip(np.floor(place).astype(np.int64) - GRID.taps // 2 + 1, 0, len(nodes) - GRID.taps)
    x = (place - start)[:, None]
    others = [[other for other in range(GRID.taps) if other != tap] for tap in range(GRID.taps)]
    weight = np.stack(
        [np.prod([(x[:, 0] - m) / (tap - m) for m in rest], axis=0) for tap, rest in enumerate(others)], axis=1
    )
    return start[:, None] + np.arange(GRID.taps), weight
