"""The conservative quantile of μ as a function of an element's normal force: a hyperbola, steeper outside the data."""

import math
import sys
from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import chain
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stiction_client.elementwise import Number, hypot, of_these, select, student_quantile
from stiction_client.errors import InvalidArgument
from stiction_client.linear_friction import LinearFriction
from stiction_client.support import beyond_velocity, extrapolation_scale


@dataclass(frozen=True, slots=True, eq=False)
class FrictionQuantile:
    """q(f) = a + c·f − √(s² + (k + g·f)² + h(f)²), with f the normal force of an element, N.

    It is the quantile of ``LinearFriction.predict`` at one velocity and probability. With Σ = L·Lᵀ, u = Lᵀ(1, v, 0),
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
        cls, model: LinearFriction, tangential_velocity: Number, probability: Number, elements: Number = 1.0
    ) -> "FrictionQuantile":
        """The quantile at ``tangential_velocity`` m/s of what so many ``elements`` of a new grasp show on average.

        Raises ``InvalidArgument`` for a model not finite there.
        """
        return cls.over(model, tangential_velocity, probability)(elements)

    @classmethod
    def over(
        cls, model: LinearFriction, tangential_velocity: Number, probability: Number
    ) -> Callable[[Number], "FrictionQuantile"]:
        """``of`` as a function of the number of elements alone, on which little of it depends."""
        shared, own = model.scatter(probability)
        error = -student_quantile(model.degrees_of_freedom, probability)
        b0, b1, b2 = coefficients = model.coefficients.tolist()
        covariance = model.covariance.tolist()
        if not (all(map(math.isfinite, chain(coefficients, *covariance))) and _finite(shared, own, error)):
            raise InvalidArgument("model", "not finite at this slip probability", "finite coefficients and quantile")
        growth, (along, along_v), (apart, apart_v, apart_vv) = _factor(covariance)
        v = tangential_velocity
        level = b0 + v * b1
        s = error * hypot(apart + v * apart_v, v * apart_vv)
        k, g = error * (along + v * along_v), error * growth
        if model.scales is not None:
            s, k, g = _joined(s, k, g, shared * level, shared * b2)
        each = -student_quantile(math.inf, probability) * extrapolation_scale(model)
        low, high = model.domain.normal_force
        below, above = (each / bound if bound > 0.0 else 0.0 * each for bound in (low, high))
        s = hypot(s, each * beyond_velocity(model.domain, v))

        def averaged(elements: Number) -> FrictionQuantile:
            scatter = own if model.scales is None else own / elements**0.5
            return cls(level, b2, hypot(s, scatter), k, g, low, high, below, above)

        return averaged

    def only(self, where: NDArray[np.bool_]) -> "FrictionQuantile":
        """The curves of these entries of arrays."""
        a, c, s, k, g = (of_these(each, where) for each in (self.a, self.c, self.s, self.k, self.g))
        below, above = (of_these(each, where) for each in (self.below, self.above))
        return FrictionQuantile(a, c, s, k, g, self.low, self.high, below, above)

    def _outside(self, force: Number) -> tuple[Number, Number]:
        """h and its slope."""
        if isinstance(force, float) and self.low <= force <= self.high:
            return 0.0, 0.0
        under: Any = (force < self.low) * self.below
        over: Any = (force > self.high) * self.above
        return over * (force - self.high) + under * (self.low - force), over - under

    def __call__(self, force: Number) -> tuple[Number, Number]:
        """The quantile [-] and its slope, 1/N."""
        axis = self.k + self.g * force
        outside, growth = self._outside(force)
        spread = (self.s * self.s + axis * axis + outside * outside) ** 0.5
        slope = (self.g * axis + growth * outside) / (spread + (spread == 0.0))
        return self.a + self.c * force - spread, self.c - slope

    def second_derivative(self, force: Number) -> Number:
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
        s, k, g = _joined(self.s, self.k, self.g, -self.above * self.high, self.above)
        still = g == 0.0  # then the spread is the same at any force
        return self.a - select(still, hypot(s, k), k), self.c - g

    def peak(self) -> float:
        """The element's normal force of most friction, N: at least 0; infinite where friction keeps growing."""
        c, s, k, g, below, above = (float(part) for part in (self.c, self.s, self.k, self.g, self.below, self.above))
        peak = _peak_of_hyperbola(c, s, k, g)
        if peak > self.high and above:
            return max(_peak_of_hyperbola(c, *_joined(s, k, g, -above * self.high, above)), self.high)
        if peak < self.low and below:
            return min(_peak_of_hyperbola(c, *_joined(s, k, g, below * self.low, -below)), self.low)
        return peak

    def mean(self, force: Number) -> Number:
        """The expected friction [-]."""
        return self.a + self.c * force

    def expected(self) -> "FrictionQuantile":
        """The mean instead: what is known were there no uncertainty and no scatter."""
        return replace(self, s=0.0, k=0.0, g=0.0, below=0.0, above=0.0)


def _factor(covariance: list[list[float]]) -> tuple[float, tuple[float, float], tuple[float, float, float]]:
    """L of Σ = L·Lᵀ with β₂ before β₀ and β₁: |r|; u·r̂ as a line in v; and two more of u's parts, which are
    ``apart`` + v·``apart_v`` and v·``apart_vv``.

    What is left of a variance within its rounding counts as nothing: that coefficient is a function of the others.
    """
    (c00, _, _), (c10, c11, _), (c20, c21, c22) = covariance
    growth = _deviation(c22, c22)
    along, along_v = (c20 / growth, c21 / growth) if growth > 0.0 else (0.0, 0.0)
    apart = _deviation(c00 - along * along, c00)
    apart_v = (c10 - along * along_v) / apart if apart > 0.0 else 0.0
    return growth, (along, along_v), (apart, apart_v, _deviation(c11 - along_v * along_v - apart_v * apart_v, c11))


def _deviation(left: float, variance: float) -> float:
    """Root of what is left of a variance."""
    return math.sqrt(left) if left > 4.0 * sys.float_info.epsilon * variance else 0.0


def _joined(s: Number, k: Number, g: Number, constant: Number, slope: Number) -> Any:
    """s, k and g with (``constant`` + ``slope``·f)² added below the root: (p₁ + q₁f)² + (p₂ + q₂f)² as one square.

    With r = (q₁, q₂), it is (p·r̂ + |r| f)² + (p × r̂)².
    """
    growth = hypot(slope, g)
    still = growth == 0.0
    safe = growth + still
    across = select(still, hypot(constant, k), (constant * g - k * slope) / safe)
    return hypot(s, across), (constant * slope + k * g) / safe, growth


def _peak_of_hyperbola(c: float, s: float, k: float, g: float) -> float:
    """The element's normal force of most friction, N, were there no end of the data."""
    if c >= g:
        return math.inf if c > 0.0 else 0.0
    return max((s * c / (math.sqrt(g - c) * math.sqrt(g + c)) - k) / g, 0.0) if c > -g else 0.0


def _finite(*numbers: Number) -> bool:
    return all(np.isfinite(each).all() if isinstance(each, np.ndarray) else math.isfinite(each) for each in numbers)
