"""The Gaussian model with the structure that grasps have; friction's coefficients integrated out in closed form.

A sample k of place e in grasp g observes ``μ = (1 + u_g) x·β + p_ge + ε_k`` with x = (1, v, f_n), u ~ N(0, τ²),
p ~ N(0, ω²), ε ~ N(0, σ²/w_k): a grasp scales the whole law, a place shifts it (Searle et al., 1992, ch. 6).

Of a grasp of one place only the level is scaled: h is x·b̂ of the place's mean. Else p_ge could make up for any u_g, and
slopes that differ from grasp to grasp, as errors that go together over time make them, would pass for an endless τ.

Given λ = τ²/σ² and ρ = ω²/σ², the places are integrated out by giving the mean of a place of weight W the weight
W/(1 + ρW) (Lindley & Smith, 1972), the grasp by the rank-one update of Sherman and Morrison along h = x·b̂, with b̂ near
the coefficients' mean; determinants follow from the same two. What is left is a normal density of β.

Where grasps are of several sensors, that of sensor j observes ``μ = (1 + s_j + u_g) x·β + …`` with s ~ N(0, κ²), its
own gain: given ν = κ²/σ² one more such update of the sums over its grasps.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import special

from estimators.defaults import GRID, PRIOR, REFERENCE, ROUNDING
from estimators.linear.grasp_statistics import GraspStatistics
from estimators.linear.normal_inverse_gamma import NormalInverseGamma
from estimators.linear.priors import WEAK, ScatterPrior, log_half_student
from estimators.linear.unknown_velocity import columns_off, offset_variance

FloatArray = NDArray[np.float64]

FIRST, SECOND = np.triu_indices(4)
WHOLE = np.zeros((4, 4), dtype=int)
WHOLE[FIRST, SECOND] = WHOLE[SECOND, FIRST] = np.arange(10)
"""Where each entry of a symmetric matrix [4, 4] stands among the ten that are kept."""


class Conditional(NamedTuple):
    """What follows at points [k]: the log density of the logarithms of the scales, mean [k, 3] and covariance of β."""

    log_density: FloatArray
    mean: FloatArray
    covariance: FloatArray


class Products(NamedTuple):
    """Sums over the grasps of each of s sensors at points [k]: the ``square`` [k, s, 10] of the rows (γ | residual),
    and a log determinant [k] of all. ``unknown`` [k, s, 10]: the part of the grasps of unknown velocity.
    """

    square: FloatArray
    log_determinant: FloatArray
    unknown: FloatArray

    def at(self, points: NDArray[np.int64] | slice) -> "Products":
        """Those at some of the points."""
        return Products(*(part[points] for part in self))

    def of_sensor(self, place: int) -> "Products":
        """Those of one of the sensors, [k, 1, 10]."""
        own = slice(place, place + 1)
        return Products(self.square[:, own], self.log_determinant, self.unknown[:, own])


class Whole(NamedTuple):
    """Sums over all sensors at points [k], their gains integrated out: ``square`` [k, 10], its log determinant [k], and
    what it has of the columns that unknown velocities are off by: ``along`` [k, 2, 4] of the rows, ``size`` [k, 2, 2].
    """

    square: FloatArray
    log_determinant: FloatArray
    along: FloatArray
    size: FloatArray

    def repeated(self, times: int) -> "Whole":
        """Each point so many times."""
        return Whole(*(np.repeat(part, times, axis=0) for part in self))

    def at(self, points: NDArray[np.int64] | slice) -> "Whole":
        """The sums at some of the points."""
        return Whole(*(part[points] for part in self))


class GainColumns(NamedTuple):
    """A sensor's gain in sums over its grasps: the products of its column h = x·b̂ with the rows, ``rows`` [..., 4],
    with itself, ``size`` [...], and with the columns that unknown velocities are off by, ``off`` [..., 2].
    """

    rows: FloatArray
    size: FloatArray
    off: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Hierarchical:
    """Rows of all grasps in coordinates γ in which the pooled fit is (0, I), so that squares may be formed.

    β = ``pooled.mean`` + ``pooled.root`` γ. Groups of places [m] in the order of their grasps: ``group`` [10, m] sums
    of squares of (γ | residual), ``count`` and ``weight`` [m] as in ``GraspStatistics``; ``start`` [g]: where those of
    each grasp begin; ``within`` [g, 10]; ``prior`` [10] the same of the prior; ``direction`` [3]: the γ of b̂;
    ``unknown`` [g]: grasps of unknown velocity, whose friction is off, all alike, by N(0, ``offset``) times each of the
    columns that ``off_by`` [2, 3] are the γ of; ``of_one_place`` [g]. Grasps are in the order of their ``sensors``:
    those of the j-th are from ``first[j]`` to ``first[j + 1]``, of [s + 1].
    """

    group: FloatArray
    count: FloatArray
    weight: FloatArray
    start: NDArray[np.int64]
    within: FloatArray
    prior: FloatArray
    direction: FloatArray
    effective_n: float
    pooled: NormalInverseGamma
    unknown: NDArray[np.bool_]
    offset: float
    off_by: FloatArray
    of_one_place: NDArray[np.bool_]
    first: NDArray[np.int64]
    sensors: tuple[str, ...]
    scatter_prior: ScatterPrior = WEAK

    def products(self, log_lambda: FloatArray, log_rho: FloatArray) -> Products:
        """Sums at all pairs of λ [l] and ρ [r], as [l · r] points of which ρ varies fastest."""
        cells = [self._given_rho(np.exp(log_lambda), rho) for rho in np.exp(log_rho)]
        square, log_determinant, unknown = (np.stack(part, axis=1) for part in zip(*cells, strict=True))
        shape = (-1, len(self.sensors), 10)
        return Products(square.reshape(shape), log_determinant.reshape(-1), unknown.reshape(shape))

    def _given_rho(self, ratio: FloatArray, rho: float) -> Products:
        """Sums for all λ [l]: what a grasp says across h stays, what it says along h shrinks by 1/(1 + λ h'h)."""
        shrunk = self.weight / (1.0 + rho * self.weight)
        level = np.add.reduceat(shrunk * self.group, self.start, axis=1).T
        grasp = self.within + level
        scaled = np.where(self.of_one_place[:, None], level, grasp)
        along = scaled[:, WHOLE[:, :3]] @ self.direction  # [g, 4]
        size = np.maximum(along[:, :3] @ self.direction, np.finfo(float).tiny)
        outer = along[:, FIRST] * along[:, SECOND] / size[:, None]
        growth = 1.0 + ratio[:, None] * size
        across, left = grasp - outer, 1.0 / growth
        square, unknown = np.zeros((2, len(ratio), len(self.sensors), 10))
        for place, own in enumerate(slice(*ends) for ends in pairwise(self.first)):
            square[:, place] = across[own].sum(axis=0) + left[:, own] @ outer[own]
            if (chosen := self.unknown[own]).any():
                unknown[:, place] = across[own][chosen].sum(axis=0) + left[:, own][:, chosen] @ outer[own][chosen]
        places = float(self.count @ np.log1p(rho * self.weight))
        return Products(square, places + np.log(growth).sum(axis=1), unknown)

    def whole(self, products: Products, log_nu: FloatArray | None = None) -> Whole:
        """The sums over all sensors at the points [k] of ``products``; without ``log_nu`` those of the only one.

        ``log_nu`` [k · q] of the scale between sensors: q for each of these points, and the sums at as many points. In
        blocks, which bound what numbers of each sensor are in memory.
        """
        square, unknown = products.square.sum(axis=1), products.unknown.sum(axis=1)
        along = unknown[:, WHOLE[:, :3]] @ self.off_by.T  # [k, 4, 2]
        whole = Whole(square, products.log_determinant, along.swapaxes(1, 2), self.off_by @ along[:, :3])
        if log_nu is None:
            return whole
        nu = np.exp(log_nu).reshape(len(square), -1)
        # of each sensor less than a matrix [4, 4] for each ν, and four for its products, columns and their squares
        blocks = blocks_of(len(nu), len(self.sensors) * WHOLE.size * (len(WHOLE) + nu.shape[1]))
        parts = [self._with_gains(whole.at(own), products.at(own), nu[own]) for own in blocks]
        return Whole(*(np.concatenate(part) for part in zip(*parts, strict=True)))

    def _with_gains(self, whole: Whole, products: Products, nu: FloatArray) -> Whole:
        """The sums at each of the points [k] with the gains of each of its ν [k, q] integrated out as grasps are."""
        rows, size, off = self.gain_columns(products)
        growth = 1.0 + nu[..., None] * size[:, None]  # [k, q, s]
        weight = nu[..., None] / growth
        determinant = whole.log_determinant[:, None] + np.log(growth).sum(axis=2)
        square = whole.square[:, None] - weight @ (rows[..., FIRST] * rows[..., SECOND])
        along, own = (np.repeat(part[:, None], nu.shape[1], axis=1) for part in (whole.along, whole.size))
        if self.unknown.any():
            shape = (*off.shape[:2], -1)
            along -= (weight @ (off[..., None] * rows[..., None, :]).reshape(shape)).reshape(along.shape)
            own -= (weight @ (off[..., None] * off[..., None, :]).reshape(shape)).reshape(own.shape)
        return Whole(*(part.reshape(-1, *part.shape[2:]) for part in (square, determinant, along, own)))

    def gain_columns(self, products: Products) -> GainColumns:
        """Those of each sensor at points [k, s]: its gain is ν/(1 + ν ``size``) times what the others add up to."""
        rows = products.square[..., WHOLE[:, :3]] @ self.direction
        unknown = products.unknown[..., WHOLE[:3, :3]] @ self.direction
        return GainColumns(rows, np.maximum(rows[..., :3] @ self.direction, 0.0), unknown @ self.off_by.T)

    def conditional(self, whole: Whole, scales: FloatArray) -> Conditional:
        """Density at points [k] with all else integrated out, and β given them.

        ``scales``: log σ, log λ, log ρ and, of several sensors, log ν, [3 or 4, k].
        """
        log_sigma, log_lambda, log_rho, *log_nu = scales
        square_of_data, determinant = self._without_offset(whole, log_sigma)
        square = square_of_data + self.prior
        precision = square[:, WHOLE[:3, :3]]
        covariance = np.linalg.inv(precision)
        gamma = np.einsum("kij,kj->ki", covariance, square[:, WHOLE[:3, 3]])
        misfit = square[:, WHOLE[3, 3]] - np.einsum("ki,ki->k", gamma, square[:, WHOLE[:3, 3]])
        log_tau, log_omega = log_sigma + 0.5 * log_lambda, log_sigma + 0.5 * log_rho
        log = -0.5 * (misfit + determinant + np.linalg.slogdet(precision)[1])
        log += -self.effective_n * log_sigma + log_prior(log_sigma, log_tau, log_omega, self.scatter_prior)
        for ratio in log_nu:
            log += log_prior_of_gains(log_sigma + 0.5 * ratio)
        root = self.pooled.root
        return Conditional(log, self.pooled.mean + gamma @ root.T, root @ covariance @ root.T)

    def _without_offset(self, whole: Whole, log_sigma: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The sums over σ², [k, 10], and their log determinant [k], with what unknown velocities are off by integrated
        out: rank-one updates as that of a grasp.
        """
        unit = np.exp(-2.0 * log_sigma)[:, None]
        square, determinant = whole.square * unit, whole.log_determinant
        if not self.unknown.any():
            return square, determinant
        along, size = whole.along * unit[..., None], whole.size * unit[..., None]
        for column in range(len(self.off_by)):
            own, growth = along[:, column], 1.0 + self.offset * size[:, column, column]
            share = (self.offset / growth)[:, None]
            square = square - share * own[:, FIRST] * own[:, SECOND]
            along = along - (share * size[:, column])[..., None] * own[:, None]
            size = size - (share * size[:, column])[..., None] * size[:, None, column]
            determinant = determinant + np.log(growth)
        return square, determinant

    def log_sigma(self, whole: Whole) -> tuple[FloatArray, float]:
        """Mean [k] and spread of log σ at points [k], the priors of β, τ and ω left aside: σ² is inverse-gamma then."""
        square = whole.square
        precision = square[:, WHOLE[:3, :3]] + ROUNDING * np.eye(3)
        solved = np.linalg.solve(precision, square[:, WHOLE[:3, 3], None])[..., 0]
        misfit = square[:, WHOLE[3, 3]] - np.einsum("ki,ki->k", solved, square[:, WHOLE[:3, 3]])
        total = np.maximum(misfit, 0.0) + PRIOR.degrees_of_freedom * REFERENCE.scatter**2
        shape = 0.5 * max(self.effective_n + PRIOR.degrees_of_freedom - 3.0, 1.0)
        mean = 0.5 * (np.log(0.5 * total) - special.digamma(shape))
        return np.asarray(mean), float(0.5 * np.sqrt(special.polygamma(1, shape)))

    def with_slope(self, precision: float) -> "Hierarchical":
        """The same with a prior of β₁ ~ N(0, 1/``precision``), precision in (m/s)², beside its own."""
        row = np.append(self.pooled.root[1], -self.pooled.mean[1])
        return replace(self, prior=self.prior + precision * _squares(row[None])[0])

    def centred_at(self, coefficients: FloatArray) -> "Hierarchical":
        """The same with another b̂ [3]."""
        return replace(self, direction=_direction(self.pooled, coefficients))


def blocks_of(points: int, floats: int) -> list[slice]:
    """The points in blocks that each take ``GRID.block_bytes`` at most, where one takes so many ``floats``."""
    block = max(1, GRID.block_bytes // (np.dtype(float).itemsize * floats))
    return [slice(begin, begin + block) for begin in range(0, points, block)]


def log_prior(
    log_sigma: FloatArray, log_tau: FloatArray, log_omega: FloatArray, scatter_prior: ScatterPrior = WEAK
) -> FloatArray:
    """Log density [k] of (log σ, log τ, log ω): σ² inverse-gamma, τ and ω half-Student-t; see ``defaults.PRIOR``."""
    scatter = -PRIOR.degrees_of_freedom * (log_sigma + 0.5 * REFERENCE.scatter**2 * np.exp(-2.0 * log_sigma))
    grasp = scatter_prior.log_density(np.exp(log_tau)) + log_tau
    place = log_half_student(np.exp(log_omega), REFERENCE.scatter, PRIOR.effect_degrees_of_freedom) + log_omega
    return np.asarray(scatter + grasp + place)


def log_prior_of_gains(log_kappa: FloatArray) -> FloatArray:
    """Log density [k] of log κ: half-Student-t; see ``defaults.PRIOR``."""
    kappa = np.exp(log_kappa)
    return log_half_student(kappa, PRIOR.sensor_scatter, PRIOR.sensor_degrees_of_freedom) + log_kappa


def hierarchical(
    grasps: Sequence[GraspStatistics],
    pooled: NormalInverseGamma,
    spans: FloatArray,
    centre: FloatArray,
    scatter_prior: ScatterPrior = WEAK,
) -> Hierarchical:
    """The model of these grasps, b̂ the pooled fit; the prior is of friction at ``centre`` and slopes over ``spans``."""
    grasps = sorted(grasps, key=lambda grasp: grasp.sensor)
    total = sum(grasp.total_weight for grasp in grasps)
    alike = sum(float((grasp.count - grasp.independent).sum()) for grasp in grasps)
    unit = total / sum(grasp.weight_square for grasp in grasps)
    group = np.concatenate([_group_squares(grasp, pooled) for grasp in grasps])
    sizes = [len(grasp.count) for grasp in grasps]
    sensors, first = np.unique([grasp.sensor for grasp in grasps], return_index=True)
    return Hierarchical(
        group=np.ascontiguousarray(group.T),
        count=np.concatenate([grasp.independent for grasp in grasps]),
        weight=unit * np.concatenate([grasp.weight for grasp in grasps]),
        start=np.concatenate([[0], np.cumsum(sizes)[:-1]]),
        within=unit * np.stack([_squares(_rows(grasp.within, pooled)).sum(axis=0) for grasp in grasps]),
        prior=_prior_square(pooled, spans, centre),
        direction=_direction(pooled, pooled.mean),
        effective_n=unit * total - alike,
        pooled=pooled,
        unknown=np.array([grasp.velocity_unknown for grasp in grasps]),
        offset=offset_variance(float(centre @ pooled.mean), float(pooled.mean[1]), float(pooled.covariance[1, 1])),
        off_by=np.stack([_direction(pooled, each) for each in columns_off(float(centre[2]))]),
        of_one_place=np.array([grasp.of_one_place for grasp in grasps]),
        first=np.append(first, len(grasps)),
        sensors=tuple(sensors.tolist()),
        scatter_prior=scatter_prior,
    )


def _direction(pooled: NormalInverseGamma, coefficients: FloatArray) -> FloatArray:
    return np.asarray(np.linalg.solve(pooled.root, coefficients))


def _group_squares(grasp: GraspStatistics, pooled: NormalInverseGamma) -> FloatArray:
    """Sums of squares [g, 10] over the places of each group, a weight of 1 each."""
    means = np.column_stack([np.ones(len(grasp.mean)), grasp.mean])
    centre = np.column_stack([means[:, :3] @ pooled.root, means[:, 3] - means[:, :3] @ pooled.mean])
    square = grasp.independent[:, None] * _squares(centre)
    if (grasp.count > 1.0).any():
        square += grasp.share * np.stack([_squares(_rows(spread, pooled)).sum(axis=0) for spread in grasp.spread])
    return square


def _rows(triangle: FloatArray, pooled: NormalInverseGamma) -> FloatArray:
    """Rows in (v, f_n | μ) about their mean as rows [3, 4] in (γ | residual)."""
    regressors = triangle[:, :2]
    return np.column_stack([regressors @ pooled.root[1:], triangle[:, 2] - regressors @ pooled.mean[1:]])


def _squares(rows: FloatArray) -> FloatArray:
    """The ten products [k, 10] of each row [k, 4]."""
    return np.asarray(rows[:, FIRST] * rows[:, SECOND])


def _prior_square(pooled: NormalInverseGamma, spans: FloatArray, centre: FloatArray) -> FloatArray:
    """The prior x·β ~ N(μ₀, width²) at ``centre``, slopes ~ N(0, width²/span²), as squares [10] in (γ | residual).

    At f_n = 0, far from data in a narrow range, a prior of β₀ would pull where noise makes the slope.
    """
    rows = np.diag(np.concatenate([[1.0], spans]))
    rows[0] = centre
    away = np.array([REFERENCE.friction, 0.0, 0.0]) - rows @ pooled.mean
    return np.asarray(_squares(np.column_stack([rows @ pooled.root, away]) / PRIOR.width).sum(axis=0))
