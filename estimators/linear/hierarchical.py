"""The Gaussian model with the structure that grasps have; friction's coefficients integrated out in closed form.

A sample k of place e in grasp g observes ``μ = (1 + u_g) x·β + p_ge + ε_k`` with x = (1, v, f_n), u ~ N(0, τ²),
p ~ N(0, ω²), ε ~ N(0, σ²/w_k): a grasp scales the whole law, a place shifts it (Searle et al., 1992, ch. 6).

Given λ = τ²/σ² and ρ = ω²/σ², the places are integrated out by giving the mean of a place of weight W the weight
W/(1 + ρW) (Lindley & Smith, 1972), the grasp by the rank-one update of Sherman and Morrison along h = x·b̂, with b̂ near
the coefficients' mean; determinants follow from the same two. What is left is a normal density of β.

Where grasps are of several sensors, that of sensor j observes ``μ = (1 + s_j + u_g) x·β + …`` with s ~ N(0, κ²), its
own gain: given ν = κ²/σ² one more such update of the sums over its grasps.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import special

from estimators.defaults import PRIOR, REFERENCE, ROUNDING
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

    def at(self, points: NDArray[np.int64]) -> "Products":
        """Those at some of the points."""
        return Products(*(part[points] for part in self))


class Whole(NamedTuple):
    """Sums over all sensors at points [k], their gains integrated out: ``square`` [k, 10], its log determinant [k], and
    what it has of the columns that unknown velocities are off by: ``along`` [k, 2, 4] of the rows, ``size`` [k, 2, 2].
    ``weight`` [k, s] times ``gain`` [k, s, 4] is how each sensor's gain follows from (γ | residual), and ``off``
    [k, s, 2] how from these columns.
    """

    square: FloatArray
    log_determinant: FloatArray
    along: FloatArray
    size: FloatArray
    weight: FloatArray
    gain: FloatArray
    off: FloatArray

    def repeated(self, times: int) -> "Whole":
        """Each point so many times."""
        return Whole(*(np.repeat(part, times, axis=0) for part in self))

    def at(self, points: NDArray[np.int64]) -> "Whole":
        """The sums at some of the points."""
        return Whole(*(part[points] for part in self))


@dataclass(frozen=True, slots=True, eq=False)
class Hierarchical:
    """Rows of all grasps in coordinates γ in which the pooled fit is (0, I), so that squares may be formed.

    β = ``pooled.mean`` + ``pooled.root`` γ. Groups of places [m] in the order of their grasps: ``group`` [10, m] sums
    of squares of (γ | residual), ``count`` and ``weight`` [m] as in ``GraspStatistics``; ``start`` [g]: where those of
    each grasp begin; ``within`` [g, 10]; ``prior`` [10] the same of the prior; ``direction`` [3]: the γ of b̂;
    ``unknown`` [g]: grasps of unknown velocity, whose friction is off, all alike, by N(0, ``offset``) times each of the
    columns that ``off_by`` [2, 3] are the γ of. ``sensor`` [g]: of which of the ``sensors`` each grasp is.
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
    sensor: NDArray[np.int64]
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
        grasp = self.within + np.add.reduceat(shrunk * self.group, self.start, axis=1).T
        along = grasp[:, WHOLE[:, :3]] @ self.direction  # [g, 4]
        size = np.maximum(along[:, :3] @ self.direction, np.finfo(float).tiny)
        outer = along[:, FIRST] * along[:, SECOND] / size[:, None]
        growth = 1.0 + ratio[:, None] * size
        across = grasp - outer
        square, unknown = (
            np.stack(
                [
                    across[chosen].sum(axis=0) + (1.0 / growth[:, chosen]) @ outer[chosen]
                    for chosen in ((self.sensor == code) & counts for code in range(len(self.sensors)))
                ],
                axis=1,
            )
            for counts in (True, self.unknown)
        )
        places = float(self.count @ np.log1p(rho * self.weight))
        return Products(square, places + np.log(growth).sum(axis=1), unknown)

    def whole(self, products: Products, log_nu: FloatArray | None = None) -> Whole:
        """The sums over all sensors at points [k]; ``log_nu`` [k] of the scale between sensors, None of one sensor.

        A sensor's gain has the column h = x·b̂, and is integrated out as a grasp's.
        """
        rows, unknown = products.square[..., WHOLE[:, :3]], products.unknown[..., WHOLE[:, :3]]
        along = unknown @ self.off_by.T  # [k, s, 4, 2]
        size = self.off_by @ along[..., :3, :]
        if log_nu is None:
            square, determinant = products.square[:, 0], products.log_determinant
            none = np.zeros((len(square), 0))
            nothing = none, np.zeros((*none.shape, 4)), np.zeros((*none.shape, 2))
            return Whole(square, determinant, along[:, 0].swapaxes(1, 2), size[:, 0], *nothing)
        gain = rows @ self.direction  # [k, s, 4]
        growth = 1.0 + np.exp(log_nu)[:, None] * np.maximum(gain[..., :3] @ self.direction, 0.0)
        weight = np.exp(log_nu)[:, None] / growth
        square = products.square - weight[..., None] * gain[..., FIRST] * gain[..., SECOND]
        shared = self.direction @ along[..., :3, :]  # [k, s, 2]
        if self.unknown.any():
            along = along - (weight[..., None] * gain)[..., None] * shared[..., None, :]
            size = size - (weight[..., None] * shared)[..., None] * shared[..., None, :]
        determinant = products.log_determinant + np.log(growth).sum(axis=1)
        summed = square.sum(axis=1), determinant, along.sum(axis=1).swapaxes(1, 2), size.sum(axis=1)
        return Whole(*summed, weight, gain, weight[..., None] * shared)

    def conditional(self, whole: Whole, scales: FloatArray) -> Conditional:
        """Density at points [k] with all else integrated out, and β given them.

        ``scales``: log σ, log λ, log ρ and, of several sensors, log ν, [3 or 4, k].
        """
        log_sigma, log_lambda, log_rho, *log_nu = scales
        told, determinant = self._without_offset(whole, log_sigma)
        square = told + self.prior
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

    def centred_at(self, coefficients: FloatArray) -> "Hierarchical":
        """The same with another b̂ [3]."""
        return replace(self, direction=_direction(self.pooled, coefficients))


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
    total = sum(grasp.total_weight for grasp in grasps)
    alike = sum(float((grasp.count - grasp.independent).sum()) for grasp in grasps)
    unit = total / sum(grasp.weight_square for grasp in grasps)
    group = np.concatenate([_group_squares(grasp, pooled) for grasp in grasps])
    sizes = [len(grasp.count) for grasp in grasps]
    sensors, sensor = np.unique([grasp.sensor for grasp in grasps], return_inverse=True)
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
        sensor=sensor,
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
