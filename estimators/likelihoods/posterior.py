"""What a likelihood hands to the sampler, and what it makes of the draws."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Summary:
    """What a friction model needs of a posterior: see ``FrictionModel``."""

    coefficients: FloatArray
    covariance: FloatArray
    scale: float
    degrees_of_freedom: float


class Posterior(Protocol):
    """A posterior in whitened coordinates, in which it is close to N(0, I)."""

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the natural parameters; β₀, β₁, β₂ and σ come first."""
        ...

    def log_probability(self, whitened: FloatArray) -> FloatArray:
        """Log posterior density [k] in whitened coordinates [k, d], up to a constant; -inf outside the support."""
        ...

    def natural(self, whitened: FloatArray) -> FloatArray:
        """Natural parameters [k, d] of whitened ones."""
        ...

    def summarise(self, whitened: FloatArray) -> Summary:
        """Mean, covariance and scale from draws [k, d] in whitened coordinates."""
        ...
