"""The hierarchical model's posterior without sampling: a grid over the scales, where all that matters lies."""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.polynomial.hermite_e import hermegauss
from numpy.typing import NDArray
from scipy import special

from estimators.defaults import GRID
from estimators.linear.fit_data import FitData
from estimators.linear.hierarchical import Hierarchical, Products, hierarchical
from estimators.linear.normal_inverse_gamma import exact_posterior
from estimators.linear.priors import WEAK, ScatterPrior, weak_spans
from estimators.linear.unknown_velocity import offset_variance

FloatArray = NDArray[np.float64]

SIGMA_NODES, SIGMA_WEIGHTS = hermegauss(GRID.sigma_nodes)


class ScaleNodes(NamedTuple):
    """Weighted points of the posterior: ``weight`` [m] that sums to 1, ``scatter`` [m, 3] of (σ, τ, ω), and β given
    them, normal with ``mean`` [m, 3] and ``covariance`` [m, 3, 3].
    """

    weight: FloatArray
    scatter: FloatArray
    mean: FloatArray
    covariance: FloatArray

    def moments(self) -> tuple[FloatArray, FloatArray]:
        """Mean [3] and covariance [3, 3] of β."""
        mean = self.weight @ self.mean
        away = self.mean - mean
        covariance = np.einsum("k,kij->ij", self.weight, self.covariance)
        return mean, covariance + np.einsum("k,ki,kj->ij", self.weight, away, away)


@dataclass(frozen=True, slots=True, eq=False)
class PosteriorGrid:
    """Nodes over ``log_lambda`` [l] and ``log_rho`` [r], with the sums there and ``log_marginal`` [l, r]."""

    model: Hierarchical
    log_lambda: FloatArray
    log_rho: FloatArray
    products: Products
    log_marginal: FloatArray
    nodes: ScaleNodes

    def prior_shift(self) -> FloatArray:
        """Move of each coefficient, in standard deviations, were the prior of β twice as wide; at the scales' mode."""
        best = int(np.argmax(self.log_marginal))
        row, column = np.unravel_index(best, self.log_marginal.shape)
        products = Products(*(part[[best]] for part in self.products))
        point = products, self.log_lambda[[row]], self.log_rho[[column]], self.model.log_sigma(products)[0]
        wide = replace(self.model, prior=0.25 * self.model.prior, offset=4.0 * self.model.offset)
        narrow, other = self.model.conditional(*point), wide.conditional(*point)
        return np.asarray(np.abs(other.mean - narrow.mean)[0] / np.sqrt(np.diag(narrow.covariance[0])))


def posterior_grid(data: FitData, scatter_prior: ScatterPrior = WEAK) -> PosteriorGrid:
    """Posterior of the hierarchical model for these data, on a grid that closes in on where its mass lies.

    b̂, along which a grasp scales the law, is the posterior mean of the grid before, of which also follows by how much
    unknown velocities put friction off.
    """
    grasps = data.grasp_statistics()
    pooled = exact_posterior(data)
    spans = weak_spans(data.domain, data.element_area)
    model = hierarchical(grasps, pooled, spans, data.mean_row(), scatter_prior)
    box = _widest(model)
    for turn in range(GRID.rounds):
        grid = _evaluated(model, box, GRID.coarse if turn < 2 else GRID.fine)
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
    """Range of (log λ, log ρ), [2, 2], that covers the scales for any σ that the data allow."""
    most = float(np.log(model.pooled.scale))
    far = np.array([GRID.no_scatter])
    least = float(model.log_sigma(model.products(far, far))[0][0])
    low, high = min(least, most), max(least, most)
    last = np.log(GRID.most_scatter) - low
    return 2.0 * np.array([[np.log(first) - high, last] for first in (GRID.least_tau, GRID.least_omega)])


def _evaluated(model: Hierarchical, box: FloatArray, count: int) -> PosteriorGrid:
    log_lambda, log_rho = (np.linspace(low, high, count) for low, high in box)
    products = model.products(log_lambda, log_rho)
    centre, spread = model.log_sigma(products)
    log_sigma = (centre[:, None] + spread * SIGMA_NODES).ravel()
    pairs = [axis.ravel() for axis in np.meshgrid(log_lambda, log_rho, indexing="ij")]
    lambdas, rhos = (np.repeat(axis, len(SIGMA_NODES)) for axis in pairs)
    repeated = Products(*(np.repeat(part, len(SIGMA_NODES), axis=0) for part in products))
    given = model.conditional(repeated, lambdas, rhos, log_sigma)
    log = given.log_density.reshape(-1, len(SIGMA_NODES)) + np.log(SIGMA_WEIGHTS) + 0.5 * SIGMA_NODES**2
    weight = special.softmax(log).ravel()
    sigma = np.exp(log_sigma)
    scatter = np.stack([sigma, sigma * np.exp(0.5 * lambdas), sigma * np.exp(0.5 * rhos)], axis=1)
    marginal = special.logsumexp(log, axis=1).reshape(count, count)
    return PosteriorGrid(
        model, log_lambda, log_rho, products, marginal, ScaleNodes(weight, scatter, given.mean, given.covariance)
    )


def _closer(grid: PosteriorGrid) -> FloatArray:
    """The box [2, 2] in which the density matters, a node wider on each side."""
    matters = grid.log_marginal > grid.log_marginal.max() - GRID.depth
    box = np.empty((2, 2))
    for axis, values in enumerate((grid.log_lambda, grid.log_rho)):
        inside = np.flatnonzero(matters.any(axis=1 - axis))
        box[axis] = values[max(inside[0] - 1, 0)], values[min(inside[-1] + 1, len(values) - 1)]
    return box
