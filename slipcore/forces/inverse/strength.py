"""The strength of a Gaussian prior, chosen by the data through singular values.

With d = A L c g/σ + e, e and c standard normal, and A L/σ = U s Vᵀ: along each singular direction the data y = Uᵀ d/σ
have the variance 1 + g² s².
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.optimize import minimize_scalar

from slipcore.errors import InvalidInput
from slipcore.forces.defaults import STRENGTH
from slipcore.forces.inverse.singular_values import singular_components
from slipcore.frames import FloatArray

Criterion = Literal["evidence", "gcv", "discrepancy"]


@dataclass(frozen=True, slots=True, eq=False)
class Spectrum:
    """Singular values ``s`` [r], largest first, and the components ``y`` [r] of data along their directions."""

    s: FloatArray
    y: FloatArray

    @classmethod
    def of(cls, whitened: FloatArray, data: FloatArray) -> "Spectrum":
        """Of a response [m, p] and data [m] that are already divided by the noise of these."""
        return cls(*singular_components(whitened, data))

    def choose(self, rest: float, count: int, criterion: Criterion) -> float:
        """The strength that a criterion prefers, up to ``STRENGTH.largest``.

        ``rest``: sum of squares of further data that no coefficient reaches; ``count`` of all data. Raises
        ``InvalidInput`` for a criterion unknown.
        """
        if criterion not in CRITERIA:
            raise InvalidInput("criterion", criterion, ", ".join(CRITERIA))

        def price(log_strength: FloatArray) -> FloatArray:
            return CRITERIA[criterion](self.s, self.y, rest, count, np.exp(log_strength)[..., None])

        least = min(STRENGTH.least_signal / self.s[0], STRENGTH.least_share * STRENGTH.largest)
        grid = np.linspace(np.log(least), np.log(STRENGTH.largest), STRENGTH.grid)
        best = int(np.argmin(price(grid)))
        around = (grid[max(best - 1, 0)], grid[min(best + 1, len(grid) - 1)])
        found = minimize_scalar(lambda at: float(price(np.asarray(at))), bounds=around, method="bounded")
        return float(np.exp(found.x))

    def log_evidence(self, strength: float) -> float:
        """Log probability of the data, without what no choice changes."""
        return -float(_evidence(self.s, self.y, 0.0, len(self.y), np.array([strength])))


def _evidence(s: FloatArray, y: FloatArray, rest: float, _count: int, strength: FloatArray) -> FloatArray:
    spread = 1.0 + (strength * s) ** 2
    return np.asarray(0.5 * (np.sum(y**2 / spread + np.log(spread), axis=-1) + rest))


def _gcv(s: FloatArray, y: FloatArray, rest: float, count: int, strength: FloatArray) -> FloatArray:
    left = 1.0 / (1.0 + (strength * s) ** 2)
    residual = np.sum((left * y) ** 2, axis=-1) + rest
    return np.asarray(np.log(residual) - 2.0 * np.log(count - len(y) + left.sum(axis=-1)))


def _discrepancy(s: FloatArray, y: FloatArray, rest: float, count: int, strength: FloatArray) -> FloatArray:
    left = 1.0 / (1.0 + (strength * s) ** 2)
    return np.asarray(np.abs(np.log((np.sum((left * y) ** 2, axis=-1) + rest) / count)))


CRITERIA: dict[str, Callable[[FloatArray, FloatArray, float, int, FloatArray], FloatArray]] = {
    "evidence": _evidence,
    "gcv": _gcv,
    "discrepancy": _discrepancy,
}
"""What the strength of a prior minimises: minus the log marginal likelihood; generalised cross-validation; how far the
residual is from the noise (Morozov); for each ``strength`` [..., 1], as [...]."""
