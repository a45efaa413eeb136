"""The conservative quantile of μ as a function of an element's normal force: a hyperbola, steeper outside the data."""

import math
from dataclasses import dataclass, replace
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from stiction_client.errors import InvalidArgument
from stiction_client.linear_friction import FloatArray, Number
from stiction_client.model import FrictionModel
from stiction_client.support import bend, beyond

Truth = bool | np.bool_ | NDArray[np.bool_]


@dataclass(frozen=True, slots=True, eq=False)
class FrictionQuantile:
    """q(f) = a + c·f − √(s² + (k + g·f)² + h(f)²), with f the normal force of an element, N.

    It is the quantile of ``FrictionModel.predict`` at one velocity and probability. With Σ = L·Lᵀ, u = Lᵀ(1, v, 0),
    r = Lᵀ(0, 0, 1) and Student's quantiles t of scatter and coefficients, the spread is
    √(t₁²σ² + t₂²|u + f·r|²), and |u + f·r|² = (u·r̂ + |r| f)² + |u − (u·r̂)r̂|²: a sum of squares, which can't turn
    negative by rounding as xᵀΣx can. Scatter between grasps, t₃²τ²(a + c·f)², adds one more square that is linear in
    f, and joins the other in the same way. Outside the data, from ``low`` to ``high`` N, the law's bend adds
    h = ``below``·max(low − f, 0) + ``above``·max(f − high, 0) (``support.widening``). q is concave. Each field is a
    float, or an array.
    """

    a: Number
    c: Number
    s: Number
    k: Number
    g: Number
    low: float = 0.0
    high: float = 0.0
    below: Number = 0.0
    above: Number = 0.0

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
        inside = cls(
            a=_plain(model.coefficients[0] + tangential_velocity * model.coefficients[1]),
            c=_plain(model.coefficients[2]),
            s=_plain(np.hypot(own, error * apart)),
            k=_plain(error * (along[0] + tangential_velocity * along[1])),
            g=_plain(error * growth),
        )
        if model.scales is not None:
            level, slope = inside.a, inside.c
            inside = inside._joined(shared * level, shared * slope)
        return inside._widened(model, tangential_velocity, probability)

    def _widened(self, model: FrictionModel, tangential_velocity: Number, probability: Number) -> "FrictionQuantile":
        """The same with what the law bends outside the data."""
        from scipy import special

        each = -special.ndtri(probability) * bend(model)
        low, high = model.domain.normal_force
        beside = each * beyond(model.domain, tangential_velocity, low)[0]
        below, above = (each / bound if bound > 0.0 else 0.0 * each for bound in (low, high))
        spread = _plain(np.hypot(self.s, beside))
        return replace(self, s=spread, low=low, high=high, below=_plain(below), above=_plain(above))

    def _joined(self, constant: Number, slope: Number) -> "FrictionQuantile":
        """The same with (``constant`` + ``slope``·f)² added below the root: (p₁ + q₁f)² + (p₂ + q₂f)² as one square.

        With r = (q₁, q₂), it is (p·r̂ + |r| f)² + (p × r̂)².
        """
        growth = np.hypot(slope, self.g)
        safe = growth + (growth == 0.0)
        along = (constant * slope + self.k * self.g) / safe
        across = np.where(growth == 0.0, np.hypot(constant, self.k), (constant * self.g - self.k * slope) / safe)
        return replace(self, s=_plain(np.hypot(self.s, across)), k=_plain(along), g=_plain(growth))

    def _outside(self, force: Number) -> tuple[Number, Number]:
        """h and its slope."""
        under = cast(Number, (force < self.low) * self.below)
        over = cast(Number, (force > self.high) * self.above)
        return over * (force - self.high) + under * (self.low - force), over - under

    def __call__(self, force: Number) -> tuple[Number, Number]:
        """The quantile [-] and its slope, 1/N."""
        axis = self.k + self.g * force
        outside, growth = self._outside(force)
        spread = (self.s * self.s + axis * axis + outside * outside) ** 0.5
        slope = (self.g * axis + growth * outside) / (spread + (spread == 0.0))
        return self.a + self.c * force - spread, self.c - slope

    def bend(self, force: Number) -> Number:
        """Second derivative, 1/N²; never positive."""
        axis = self.k + self.g * force
        outside, growth = self._outside(force)
        spread: Number = (self.s * self.s + axis * axis + outside * outside) ** 0.5
        spread = spread + (spread == 0.0)
        turning = self.s * self.s * (self.g * self.g + growth * growth) + (self.g * outside - growth * axis) ** 2
        return -turning / spread / spread / spread

    @property
    def asymptote(self) -> tuple[Number, Number]:
        """A and C of a line A + C·f that is nowhere below q, and meets it where f is great."""
        last = self._joined(-self.above * self.high, self.above)
        still = last.g == 0.0  # then the spread is the same at any force
        spread = still * (last.s * last.s + last.k * last.k) ** 0.5
        return last.a - spread - (1.0 - still) * last.k, last.c - last.g

    def peak(self) -> float:
        """The element's normal force of most friction, N: at least 0; infinite where friction keeps growing."""
        inside = self._peak_of_hyperbola()
        if inside > self.high and np.any(self.above):
            return max(self._joined(-self.above * self.high, self.above)._peak_of_hyperbola(), self.high)
        if inside < self.low and np.any(self.below):
            return min(self._joined(self.below * self.low, -self.below)._peak_of_hyperbola(), self.low)
        return inside

    def _peak_of_hyperbola(self) -> float:
        """The same where the data have no end."""
        c, s, k, g = (float(part) for part in (self.c, self.s, self.k, self.g))
        if c >= g:
            return math.inf if c > 0.0 else 0.0
        return max((s * c / (math.sqrt(g - c) * math.sqrt(g + c)) - k) / g, 0.0) if c > -g else 0.0

    def expected(self) -> "FrictionQuantile":
        """The mean instead: what is known were there no uncertainty and no scatter."""
        return replace(self, s=0.0, k=0.0, g=0.0, below=0.0, above=0.0)


def _plain(value: Any) -> Number:
    """A float where it is one number, which computes ten times as fast as NumPy's."""
    return float(value) if np.ndim(value) == 0 else cast(FloatArray, value)
