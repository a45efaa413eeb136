"""The conservative quantile of μ as a function of an element's normal force: a hyperbola."""

import math
from dataclasses import dataclass, replace
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from stiction_client.errors import InvalidArgument
from stiction_client.model import FloatArray, FrictionModel, Number

Truth = bool | np.bool_ | NDArray[np.bool_]


@dataclass(frozen=True, slots=True, eq=False)
class FrictionQuantile:
    """q(f) = a + c·f − √(s² + (k + g·f)²), with f the normal force of an element, N.

    It is the quantile of ``FrictionModel.predict`` at one velocity and probability. With Σ = L·Lᵀ, u = Lᵀ(1, v, 0),
    r = Lᵀ(0, 0, 1) and Student's quantiles t of scatter and coefficients, the spread is
    √(t₁²σ² + t₂²|u + f·r|²), and |u + f·r|² = (u·r̂ + |r| f)² + |u − (u·r̂)r̂|²: a sum of squares, which can't turn
    negative by rounding as xᵀΣx can. Scatter between grasps, t₃²τ²(a + c·f)², adds one more square that is linear in
    f, and joins the other in the same way. q is concave. Each field is a float, or an array.
    """

    a: Number
    c: Number
    s: Number
    k: Number
    g: Number

    @classmethod
    def of(
        cls, model: FrictionModel, tangential_velocity: Number, probability: Number, elements: Number = 1.0
    ) -> "FrictionQuantile":
        """The quantile at ``tangential_velocity`` m/s of what so many ``elements`` of a new grasp show on average.

        Raises ``InvalidArgument`` for a model not finite there.
        """
        from scipy import special  # takes longer to import than all else of this package

        shared, own = model.scatter(probability, elements)
        error = -special.stdtrit(model.degrees_of_freedom, probability)
        spread = [np.sum(shared), np.sum(own), np.sum(error)]
        if not np.isfinite([*model.coefficients, *model.covariance.flat, *spread]).all():
            raise InvalidArgument("model", "not finite at this slip probability", "finite coefficients and quantile")
        variance, axes = np.linalg.eigh(model.covariance)
        factor = axes * np.sqrt(np.maximum(variance, 0.0))
        growth = math.hypot(*factor[2])
        direction = factor[2] / growth if growth > 0.0 else factor[2]
        along = factor[:2] @ direction
        across = factor[:2] - np.outer(along, direction)
        apart = ((across[0] + np.multiply.outer(tangential_velocity, across[1])) ** 2).sum(axis=-1) ** 0.5
        without_grasps = cls(
            a=_plain(model.coefficients[0] + tangential_velocity * model.coefficients[1]),
            c=_plain(model.coefficients[2]),
            s=_plain(np.hypot(own, error * apart)),
            k=_plain(error * (along[0] + tangential_velocity * along[1])),
            g=_plain(error * growth),
        )
        return without_grasps if model.scales is None else without_grasps._with_grasps(shared)

    def _with_grasps(self, part: Number) -> "FrictionQuantile":
        """The same with scatter of the whole law by a ``part`` of it: (p₁ + q₁f)² + (p₂ + q₂f)² as one such square.

        With r = (q₁, q₂), it is (p·r̂ + |r| f)² + (p × r̂)².
        """
        constant, slope = part * self.a, part * self.c
        growth = np.hypot(slope, self.g)
        safe = growth + (growth == 0.0)
        along = (constant * slope + self.k * self.g) / safe
        across = np.where(growth == 0.0, np.hypot(constant, self.k), (constant * self.g - self.k * slope) / safe)
        return replace(self, s=_plain(np.hypot(self.s, across)), k=_plain(along), g=_plain(growth))

    def __call__(self, force: Number) -> tuple[Number, Number]:
        """The quantile [-] and its slope, 1/N."""
        axis = self.k + self.g * force
        spread = (self.s * self.s + axis * axis) ** 0.5
        return self.a + self.c * force - spread, self.c - self.g * axis / (spread + (spread == 0.0))

    def bend(self, force: Number) -> Number:
        """Second derivative, 1/N²; never positive."""
        spread: Number = (self.s * self.s + (self.k + self.g * force) ** 2) ** 0.5
        spread = spread + (spread == 0.0)
        return -((self.g * self.s / spread) ** 2) / spread

    @property
    def asymptote(self) -> tuple[Number, Number]:
        """A and C of a line A + C·f that is nowhere below q, and meets it where f is great."""
        still = self.g == 0.0  # then the spread is the same at any force
        spread = still * (self.s * self.s + self.k * self.k) ** 0.5
        return self.a - spread - (1.0 - still) * self.k, self.c - self.g

    def peak(self) -> float:
        """The element's normal force of most friction, N: at least 0; infinite where friction keeps growing."""
        c, s, k, g = (float(part) for part in (self.c, self.s, self.k, self.g))
        if c >= g:
            return math.inf if c > 0.0 else 0.0
        return max((s * c / (math.sqrt(g - c) * math.sqrt(g + c)) - k) / g, 0.0) if c > -g else 0.0

    def expected(self) -> "FrictionQuantile":
        """The mean instead: what is known were there no uncertainty and no scatter."""
        return replace(self, s=0.0, k=0.0, g=0.0)


def _plain(value: Any) -> Number:
    """A float where it is one number, which computes ten times as fast as NumPy's."""
    return float(value) if np.ndim(value) == 0 else cast(FloatArray, value)
