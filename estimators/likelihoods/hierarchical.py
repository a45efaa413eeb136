"""Scatter between grasps, between places and within: emcee walks on the three scales, all else is integrated out."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimators.defaults import GRID, SAMPLING
from estimators.likelihoods.posterior import PosteriorSummary
from estimators.linear.fit_data import FitData
from estimators.linear.hierarchical import Conditional, Products, Whole, blocks_of
from estimators.linear.mixture_summary import summarise
from estimators.linear.posterior_grid import PosteriorGrid, ScaleNodes, posterior_grid
from estimators.linear.priors import WEAK, ScatterPrior
from estimators.linear.sensor_gains import Gains
from estimators.sampling.normal_score import NormalScore, normal_score
from estimators.sampling.proposal import StudentMixture, standard

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class HierarchicalPosterior:
    """Posterior of (log σ, log τ, log ω) and, of several sensors, log κ; a point costs as much however many grasps.

    The sums over grasps are tabulated by ``grid`` and interpolated between its nodes. Whitened: log λ = 2 log τ/σ,
    log ρ = 2 log ω/σ and log ν = 2 log κ/σ are ``scores`` of standard normals that follow their own marginals; log σ is
    standardised given them. ``at`` (1, v, f_n) [3] is where friction is summarised.
    """

    grid: PosteriorGrid
    scores: tuple[NormalScore, ...]
    at: FloatArray
    prior: str
    sampled: tuple[str, ...]
    names: tuple[str, ...]
    proposal: StudentMixture
    local: float = 0.0

    def log_probability(self, whitened: FloatArray) -> FloatArray:
        """Log posterior density [k] in whitened coordinates; -inf outside the grid, where there is next to none."""
        ratios, slopes = self._ratios(whitened)
        whole, scales = self._at(whitened, ratios)
        log = self.grid.model.conditional(whole, scales).log_density
        for slope in slopes:
            log = log + slope
        return np.where(self._inside(ratios), log, -np.inf)

    def products(self, log_lambda: FloatArray, log_rho: FloatArray, of: Products | None = None) -> Products:
        """The sums over grasps at points [k]: polynomials between the grid's nodes, those at its edge beyond.

        ``of``: those at the nodes, by default of all sensors.
        """
        first, left = _taps(self.grid.axes[0], log_lambda)
        second, right = _taps(self.grid.axes[1], log_rho)
        columns = len(self.grid.axes[1])
        node = (first[:, :, None] * columns + second[:, None, :]).reshape(len(first), -1)
        weight = (left[:, :, None] * right[:, None, :]).reshape(len(first), -1)
        square, log_determinant, unknown = self.grid.products if of is None else of
        return Products(
            np.einsum("kt,kt...->k...", weight, square[node]),
            np.einsum("kt,kt->k", weight, log_determinant[node]),
            np.einsum("kt,kt...->k...", weight, unknown[node]),
        )

    def nodes(self, whitened: FloatArray) -> ScaleNodes:
        """Draws [k, 3 or 4] as nodes of equal weight, with what is known of β and of the gains given each."""
        whole, scales = self._at(whitened, self._ratios(whitened)[0])
        given, sigma = self.grid.model.conditional(whole, scales), np.exp(scales[0])
        scatter = np.stack([sigma, *(sigma * np.exp(0.5 * ratio) for ratio in scales[1:])], axis=1)
        weight = np.full(len(sigma), 1.0 / len(sigma))
        return ScaleNodes(weight, scatter, given.mean, given.covariance, *self._gains(scales, given))

    def _gains(self, scales: FloatArray, given: Conditional) -> list[Gains]:
        """Of several sensors, what is known of their gains at points, given the scales [4, k]."""

        def of_sensor(place: int) -> Products:
            return self.products(scales[1], scales[2], self.grid.products.of_sensor(place))

        points, sigma = np.arange(scales.shape[1]), np.exp(scales[0])
        return [Gains(self.grid.model, of_sensor, points, np.exp(log_nu), sigma, given) for log_nu in scales[3:]]

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

    def _ratios(self, whitened: FloatArray) -> tuple[FloatArray, list[FloatArray]]:
        """log λ, log ρ and log ν [2 or 3, k], and the logarithms of their slopes over the whitened coordinates."""
        scored = [score(column) for score, column in zip(self.scores, whitened[:, 1:].T, strict=True)]
        return np.stack([value for value, _ in scored]), [slope for _, slope in scored]

    def _at(self, whitened: FloatArray, ratios: FloatArray) -> tuple[Whole, FloatArray]:
        """The sums at points [k], and log σ with the ratios, [3 or 4, k]."""
        model = self.grid.model
        floats = 2 * self.grid.products.square[0].size * GRID.taps**2
        parts = [
            model.whole(self.products(*ratios[:2, own]), *ratios[2:, own]) for own in blocks_of(len(whitened), floats)
        ]
        whole = Whole(*(np.concatenate(part) for part in zip(*parts, strict=True)))
        centre, spread = model.log_sigma(whole)
        return whole, np.stack([centre + spread * whitened[:, 0], *ratios])

    def _inside(self, ratios: FloatArray) -> NDArray[np.bool_]:
        within = [(ratio >= axis[0]) & (ratio <= axis[-1]) for ratio, axis in zip(ratios, self.grid.axes, strict=True)]
        return np.asarray(np.all(within, axis=0))


def hierarchical(data: FitData, scatter_prior: ScatterPrior = WEAK) -> HierarchicalPosterior:
    """Posterior from each grasp's statistics by place."""
    grid = posterior_grid(data, scatter_prior)
    density = np.exp(grid.log_marginal - grid.log_marginal.max())
    scores, axes = [], range(len(grid.axes))
    for axis in axes:
        others = tuple(other for other in axes if other != axis)
        with np.errstate(divide="ignore"):  # next to no density is none where gains were left out
            scores.append(_score(grid.axes[axis], np.log(density.sum(axis=others))))
    scales = ("sigma", "tau", "omega", "kappa")[: 1 + len(axes)]
    return HierarchicalPosterior(
        grid=grid,
        scores=tuple(scores),
        at=data.mean_row(),
        prior=grid.prior,
        sampled=tuple(f"log_{name}" for name in scales),
        names=("beta0", "beta1", "beta2", *scales),
        proposal=standard(len(scales)),
    )


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
