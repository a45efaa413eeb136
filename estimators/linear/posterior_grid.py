"""The hierarchical model's posterior without sampling: a grid over the scales, where all that matters lies."""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.polynomial.hermite_e import hermegauss
from numpy.typing import NDArray
from scipy import special

from estimators.defaults import GRID
from estimators.linear.assumed_slope import AssumedSlope, assumed_slope
from estimators.linear.fit_data import FitData
from estimators.linear.hierarchical import Hierarchical, Products, Whole, hierarchical
from estimators.linear.log_sum import log_sum
from estimators.linear.normal_inverse_gamma import exact_posterior
from estimators.linear.priors import WEAK, ScatterPrior, structured, weak_spans
from estimators.linear.sensor_gains import Gains
from estimators.linear.slopes_of_grasps import with_slopes_that_differ
from estimators.linear.unknown_velocity import offset_variance

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

SIGMA_NODES, SIGMA_WEIGHTS = hermegauss(GRID.sigma_nodes)


class ScaleNodes(NamedTuple):
    """Weighted points of the posterior: ``weight`` [m] that sums to 1, ``scatter`` [m, 3 or 4] of (σ, τ, ω) and, of
    several sensors, κ; β given them, normal with ``mean`` [m, 3] and ``covariance`` [m, 3, 3]; and those sensors'
    ``gains``.
    """

    weight: FloatArray
    scatter: FloatArray
    mean: FloatArray
    covariance: FloatArray
    gains: Gains | None = None

    def moments(self) -> tuple[FloatArray, FloatArray]:
        """Mean [3] and covariance [3, 3] of β."""
        mean = self.weight @ self.mean
        away = self.mean - mean
        covariance = np.einsum("k,kij->ij", self.weight, self.covariance)
        return mean, covariance + np.einsum("k,ki,kj->ij", self.weight, away, away)


@dataclass(frozen=True, slots=True, eq=False)
class PosteriorGrid:
    """Nodes over ``axes``, log λ [l], log ρ [r] and, of several sensors, log ν [q]; with the sums at the first two, and
    ``log_marginal`` [l, r (, q)]. ``slope``: the prior of β₁ that is assumed where the data do not show it.
    """

    model: Hierarchical
    axes: tuple[FloatArray, ...]
    products: Products
    log_marginal: FloatArray
    nodes: ScaleNodes
    slope: AssumedSlope | None = None

    @property
    def prior(self) -> str:
        """The prior in words and numbers."""
        assumed = 0.0 if self.slope is None else self.slope.precision
        return structured(self.model.scatter_prior, len(self.model.sensors), assumed)

    def prior_shift(self) -> FloatArray:
        """Move of each coefficient, in standard deviations, were the prior of β twice as wide; at the scales' mode."""
        best = np.unravel_index(int(np.argmax(self.log_marginal)), self.log_marginal.shape)
        ratios = np.array([[axis[place]] for axis, place in zip(self.axes, best, strict=True)])
        cell = np.array([best[0] * len(self.axes[1]) + best[1]])
        whole = self.model.whole(self.products.at(cell), *ratios[2:])
        scales = np.stack([self.model.log_sigma(whole)[0], *ratios])
        wide = replace(self.model, prior=0.25 * self.model.prior, offset=4.0 * self.model.offset)
        narrow, other = self.model.conditional(whole, scales), wide.conditional(whole, scales)
        return np.asarray(np.abs(other.mean - narrow.mean)[0] / np.sqrt(np.diag(narrow.covariance[0])))


def posterior_grid(data: FitData, scatter_prior: ScatterPrior = WEAK) -> PosteriorGrid:
    """Posterior of the hierarchical model for these data; where they leave β₁ open, by a prior of it that is assumed.

    Whether they do is seen from the posterior without that prior, so that the grid is then made twice.
    """
    pooled = exact_posterior(data)
    grasps = with_slopes_that_differ(data.grasp_statistics(), pooled.mean)
    spans = weak_spans(data.domain, data.element_area)
    grid = _closed_in(hierarchical(grasps, pooled, spans, data.mean_row(), scatter_prior), data)
    mean, covariance = grid.nodes.moments()
    slope = assumed_slope(data, float(mean[1]), covariance)
    if slope is None:
        return grid
    return replace(_closed_in(grid.model.with_slope(slope.precision), data), slope=slope)


def _closed_in(model: Hierarchical, data: FitData) -> PosteriorGrid:
    """The posterior on a grid that closes in, round by round, on where its mass lies.

    Each grid gives the next one b̂, along which a grasp scales the law (its posterior mean), and by how much unknown
    velocities put friction off.
    """
    box = _widest(model)
    fine = GRID.fine if len(box) == 2 else GRID.beside_gains
    for turn in range(GRID.rounds):
        grid = _evaluated(model, box, GRID.coarse if turn < 2 else fine)
        closer = _closer(grid)
        settled = turn >= 2 and bool((np.ptp(closer, axis=1) > GRID.settled * np.ptp(box, axis=1)).all())
        if settled:
            break
        box = closer
        mean, covariance = grid.nodes.moments()
        offset = offset_variance(data.mean_friction, float(mean[1]), float(covariance[1, 1]))
        model = replace(model.centred_at(mean), offset=offset)
    return grid


def _widest(model: Hierarchical) -> FloatArray:
    """Range of log λ, log ρ and, of several sensors, log ν, [2 or 3, 2], for any σ that the data allow."""
    most = float(np.log(model.pooled.scale))
    far = np.array([GRID.no_scatter])
    alone = [-far] if len(model.sensors) > 1 else []
    least = float(model.log_sigma(model.whole(model.products(far, far), *alone))[0][0])
    low, high = min(least, most), max(least, most)
    last = np.log(GRID.most_scatter) - low
    firsts = [GRID.least_tau, GRID.least_omega, *(GRID.least_gain for _ in alone)]
    return 2.0 * np.array([[np.log(first) - high, last] for first in firsts])


def _evaluated(model: Hierarchical, box: FloatArray, count: int) -> PosteriorGrid:
    nodes_of = (count, count, GRID.gain_nodes)[: len(box)]
    axes = tuple(np.linspace(low, high, nodes) for (low, high), nodes in zip(box, nodes_of, strict=True))
    products = model.products(axes[0], axes[1])
    ratios = np.stack([each.ravel() for each in np.meshgrid(*axes, indexing="ij")])
    whole = model.whole(products, *ratios[2:])
    centre, spread = model.log_sigma(whole)
    matters = np.arange(len(centre)) if len(axes) == 2 else _that_matter(model, whole, np.stack([centre, *ratios]))
    if len(matters) < len(centre):
        whole, ratios, centre = whole.at(matters), ratios[:, matters], centre[matters]
    nodes = len(SIGMA_NODES)
    log_sigma = (centre[:, None] + spread * SIGMA_NODES).ravel()
    scales = np.stack([log_sigma, *(np.repeat(axis, nodes) for axis in ratios)])
    given = model.conditional(whole.repeated(nodes), scales)
    log = given.log_density.reshape(-1, nodes) + np.log(SIGMA_WEIGHTS) + 0.5 * SIGMA_NODES**2
    weight = special.softmax(log).ravel()
    sigma = np.exp(log_sigma)
    scatter = np.stack([sigma, *(sigma * np.exp(0.5 * axis) for axis in scales[1:])], axis=1)
    marginal = np.full([len(axis) for axis in axes], -np.inf)
    marginal.flat[matters] = log_sum(log, axis=1)
    cell = matters // (marginal.size // (count * count))
    gains = [Gains(model, products.of_sensor, cell, np.exp(log_nu), sigma, given) for log_nu in ratios[2:]]
    return PosteriorGrid(
        model, axes, products, marginal, ScaleNodes(weight, scatter, given.mean, given.covariance, *gains)
    )


def _that_matter(model: Hierarchical, whole: Whole, scales: FloatArray) -> IntArray:
    """The points whose density, at the likeliest σ, is not next to none: an axis more would cost as many times."""
    log = model.conditional(whole, scales).log_density
    return np.flatnonzero(log > log.max() - GRID.depth)


def _closer(grid: PosteriorGrid) -> FloatArray:
    """The box [2 or 3, 2] in which the density matters, a node wider on each side."""
    matters = grid.log_marginal > grid.log_marginal.max() - GRID.depth
    box = np.empty((len(grid.axes), 2))
    for axis, values in enumerate(grid.axes):
        others = tuple(other for other in range(len(grid.axes)) if other != axis)
        inside = np.flatnonzero(matters.any(axis=others))
        box[axis] = values[max(inside[0] - 1, 0)], values[min(inside[-1] + 1, len(values) - 1)]
    return box
