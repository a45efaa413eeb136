"""What the grasps of several sensors say of each sensor's own gain, beside the friction that they all felt."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from estimators.linear.hierarchical import Conditional, Hierarchical, Products

FloatArray = NDArray[np.float64]


class SensorGain(NamedTuple):
    """One sensor's gain at nodes [m], normal given β and the scales, and so together with β: ``mean`` [m], ``variance``
    [m] and the covariance with β, ``with_coefficients`` [m, 3]. It changes by ``slope`` [m, 3] over β and by ``off``
    [m, 2] over what unknown velocities are off by.
    """

    mean: FloatArray
    variance: FloatArray
    with_coefficients: FloatArray
    slope: FloatArray
    off: FloatArray

    def moments(self, weight: FloatArray) -> tuple[float, float]:
        """Mean and variance over nodes of these ``weight`` [m]."""
        mean = weight @ self.mean
        return float(mean), float(weight @ (self.variance + (self.mean - mean) ** 2))


@dataclass(frozen=True, slots=True, eq=False)
class Gains:
    """Gains of the model's sensors at nodes [m], each found when it is asked for: of all at once there may be too many.

    ``products`` gives one sensor's sums at points [k]; ``point`` [p]: at which of these each pair of them and ``nu``
    [p] is. Nodes are the pairs, with as many values of ``sigma`` [m] each, next to each other. ``given``: β at nodes.
    """

    model: Hierarchical
    products: Callable[[int], Products]
    point: NDArray[np.int64]
    nu: FloatArray
    sigma: FloatArray
    given: Conditional

    @property
    def names(self) -> tuple[str, ...]:
        """Of the sensors."""
        return self.model.sensors

    def of(self, place: int) -> SensorGain:
        """That of one sensor, by its place among ``names``.

        ν/(1 + ν q) hᵀ(residual) with the variance σ²ν/(1 + ν q), q = hᵀh (Searle et al., 1992, ch. 7). What unknown
        velocities are off by keeps its prior here, which leaves no gain better known than it is.
        """
        pooled, given = self.model.pooled, self.given
        rows, size, off = (part[self.point, 0] for part in self.model.gain_columns(self.products(place)))
        weight = self.nu / (1.0 + self.nu * size)
        found = np.column_stack([weight, weight[:, None] * np.column_stack([rows[:, 3], rows[:, :3], off])])
        found = np.repeat(found, len(self.sigma) // len(self.nu), axis=0)
        weight, level, slope, off = found[:, 0], found[:, 1], -found[:, 2:5] @ np.linalg.inv(pooled.root), found[:, 5:]
        with_coefficients = np.einsum("mi,mij->mj", slope, given.covariance)
        mean = level + np.einsum("mi,mi->m", slope, given.mean - pooled.mean)
        variance = np.einsum("mi,mi->m", with_coefficients, slope) + self.sigma**2 * weight
        variance += self.model.offset * np.einsum("mi,mi->m", off, off)
        return SensorGain(mean, variance, with_coefficients, slope, off)

    def difference(self, first: int, second: int) -> tuple[FloatArray, FloatArray]:
        """Mean [m] and variance [m] of how much one sensor's gain exceeds another's."""
        one, other = self.of(first), self.of(second)
        shared = np.einsum("mi,mi->m", one.with_coefficients, other.slope)
        shared += self.model.offset * np.einsum("mi,mi->m", one.off, other.off)
        return one.mean - other.mean, one.variance + other.variance - 2.0 * shared

    def moments(self, weight: FloatArray, places: Sequence[int]) -> tuple[FloatArray, FloatArray]:
        """Mean [c] and covariance [c, c] of some sensors' gains over nodes of these ``weight`` [m]."""
        chosen = [self.of(place) for place in places]
        at_nodes = np.stack([gain.mean for gain in chosen])
        mean = at_nodes @ weight
        away = at_nodes - mean[:, None]
        covariance = (weight * away) @ away.T
        for left, right, scale in (("with_coefficients", "slope", 1.0), ("off", "off", self.model.offset)):
            ahead, behind = (np.stack([getattr(gain, name) for gain in chosen]) for name in (left, right))
            covariance += scale * np.einsum("m,imk,jmk->ij", weight, ahead, behind, optimize=True)
        np.fill_diagonal(covariance, [gain.moments(weight)[1] for gain in chosen])
        return mean, covariance
