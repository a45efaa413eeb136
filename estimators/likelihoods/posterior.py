"""What a likelihood hands to the sampler, and what it makes of the draws."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from estimators.defaults import ROUNDING, SAMPLING
from estimators.friction_model import Domain, Scales
from estimators.sampling.proposal import StudentMixture

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class PosteriorSummary:
    """What a fit found of the coefficients and the scatter: see ``FrictionModel``.

    ``draws`` [k, names] in natural parameters, and the ``monte_carlo_error``, where a posterior was sampled.
    """

    coefficients: NDArray[np.floating]
    covariance: FloatArray
    scale: float
    degrees_of_freedom: float
    scatter_degrees_of_freedom: float
    scales: Scales | None = None
    draws: FloatArray | None = None
    monte_carlo_error: float = 0.0


class Posterior(Protocol):
    """A posterior in whitened coordinates, in which it is close to N(0, I)."""

    @property
    def sampled(self) -> tuple[str, ...]:
        """Names of the sampled coordinates."""
        ...

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the natural parameters: β₀, β₁, β₂ and σ come first."""
        ...

    @property
    def prior(self) -> str:
        """The prior in words and numbers."""
        ...

    @property
    def proposal(self) -> StudentMixture:
        """What its independence sampling proposes."""
        ...

    @property
    def local(self) -> float:
        """Part of small steps that its sampling needs."""
        ...

    def log_probability(self, whitened: FloatArray) -> FloatArray:
        """Log posterior density [k] in whitened coordinates [k, d], up to a constant; -inf outside the support."""
        ...

    def summarise(self, whitened: FloatArray, rng: np.random.Generator, /) -> PosteriorSummary:
        """What draws [k, d] in whitened coordinates amount to; ``rng`` draws what was integrated out."""
        ...


@dataclass(frozen=True, slots=True, eq=False)
class Whitening:
    """Affine map w → centre + root w that makes a density close to N(0, I)."""

    centre: FloatArray
    root: FloatArray

    def __call__(self, whitened: FloatArray) -> FloatArray:
        """Coordinates [k, d] of whitened ones [k, d]."""
        return np.asarray(self.centre + whitened @ self.root.T)


def scatter(variance: FloatArray) -> tuple[float, float]:
    """Scale s and degrees of freedom ν of the scaled-inverse-χ² with the draws' mean and spread of 1/σ².

    A new observation with that variance is then s times a Student-t on ν degrees of freedom.
    """
    precision = 1.0 / variance
    mean = float(precision.mean())
    return float(1.0 / np.sqrt(mean)), float(2.0 * mean**2 / max(precision.var(), ROUNDING * mean**2))


def corners(domain: Domain) -> FloatArray:
    """The four corners (1, v, f_n) of the data's domain, [4, 3]."""
    return np.array([[1.0, v, f_n] for v in domain.tangential_velocity for f_n in domain.normal_force])


def supported(log_density: FloatArray, beta: FloatArray, at: FloatArray) -> FloatArray:
    """The log density with -inf where the mean friction at one of the points ``at`` [m, 3] is not above 0."""
    return np.where((beta @ at.T > 0.0).all(axis=1), log_density, -np.inf)


def bounded_exp(x: FloatArray) -> FloatArray:
    """Exponential that neither overflows nor reaches zero: far tails of a proposal are only rejected."""
    return np.asarray(np.exp(np.clip(x, -SAMPLING.largest_exponent, SAMPLING.largest_exponent)))
