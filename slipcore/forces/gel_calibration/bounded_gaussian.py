"""A posterior whose density is known at a few points: the Gaussian through them, within bounds."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from slipcore.forces.defaults import GEL_CALIBRATION
from slipcore.frames import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class BoundedGaussian:
    """Points [g, d] on a lattice within the bounds, and their probabilities [g]."""

    points: FloatArray
    weights: FloatArray

    @property
    def mean(self) -> FloatArray:
        """[d]."""
        return np.asarray(self.weights @ self.points)

    @property
    def covariance(self) -> FloatArray:
        """[d, d]."""
        away = self.points - self.mean
        return np.asarray((away * self.weights[:, None]).T @ away)

    def quantile(self, axis: int, share: float) -> float:
        """Of one coordinate."""
        values, mass = self._marginal(axis)
        return float(np.interp(share, np.cumsum(mass) - 0.5 * mass, values))

    def density(self, axis: int, value: float) -> float:
        """Of one coordinate at a value, over its largest."""
        values, mass = self._marginal(axis)
        return float(np.interp(value, values, mass) / mass.max())

    def _marginal(self, axis: int) -> tuple[FloatArray, FloatArray]:
        values, index = np.unique(self.points[:, axis], return_inverse=True)
        return values, np.asarray(np.bincount(index, self.weights), dtype=np.float64)


def through(points: FloatArray, values: FloatArray, low: FloatArray, high: FloatArray) -> BoundedGaussian:
    """The Gaussian whose log density is nearest to ``values`` [n] at ``points`` [n, d], within bounds [d].

    Points nearly as probable as the best one count. Where these have no summit among them, as at a bound or where
    values are rough, the best one is taken for it, and the width is that by which all others fall.
    """
    best = int(np.argmax(values))
    centre, fall = points[best], values[best] - values
    spread = np.maximum(np.ptp(points, axis=0), np.finfo(float).eps * (high - low))
    away = (points - centre) / spread
    near = fall <= max(GEL_CALIBRATION.near, np.sort(fall)[min(len(fall), _count(len(low)) + 1) - 1])
    summit, precision = _summit(away[near], fall[near])
    inside = (summit >= away[near].min(axis=0)) & (summit <= away[near].max(axis=0))
    if not inside.all() or np.linalg.eigvalsh(precision)[0] <= 0.0:
        summit, precision = np.zeros(len(low)), _precision(away, fall)
    reach = GEL_CALIBRATION.reach * spread * np.sqrt(np.diag(np.linalg.inv(precision)))
    middle = centre + spread * summit
    sides = [
        first + (last - first) * (np.arange(GEL_CALIBRATION.lattice) + 0.5) / GEL_CALIBRATION.lattice
        for first, last in zip(np.maximum(low, middle - reach), np.minimum(high, middle + reach), strict=True)
    ]
    lattice = np.stack([side.ravel() for side in np.meshgrid(*sides, indexing="ij")], axis=-1)
    beside = (lattice - middle) / spread
    weights = np.exp(-0.5 * np.sum(beside @ precision * beside, axis=1))
    return BoundedGaussian(lattice, weights / weights.sum())


def _count(d: int) -> int:
    """Terms of a quadratic."""
    return (d + 1) * (d + 2) // 2


def _summit(away: FloatArray, fall: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Where the quadratic nearest to what points fall by has its summit, and its precision [d, d]; not a number and
    zeros where it has none.
    """
    d = away.shape[1]
    terms = np.column_stack((np.ones(len(away)), away, _products(away)))
    found = np.linalg.lstsq(terms, fall, rcond=None)[0]
    precision = _symmetric(found[1 + d :], d)
    if np.linalg.matrix_rank(precision) < d:
        return np.full(d, np.nan), np.zeros((d, d))
    return -np.linalg.solve(precision, found[1 : 1 + d]), precision


def _precision(away: FloatArray, fall: FloatArray) -> FloatArray:
    """Of what falls from the origin, each point by its share of error; next to none where nothing falls."""
    d, weight = away.shape[1], 1.0 / (1.0 + fall)
    found = np.linalg.lstsq(weight[:, None] * _products(away), weight * fall, rcond=None)[0]
    size, direction = np.linalg.eigh(_symmetric(found, d))
    return np.asarray((direction * np.maximum(size, GEL_CALIBRATION.least_precision)) @ direction.T)


def _products(away: FloatArray) -> FloatArray:
    first, second = np.triu_indices(away.shape[1])
    return away[:, first] * away[:, second]


def _symmetric(upper: NDArray[Any], d: int) -> FloatArray:
    half = np.zeros((d, d))
    half[np.triu_indices(d)] = upper
    return np.asarray(half + half.T)
