"""The exact posterior of the linear Gaussian model with independent errors, by conjugacy."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import special

from estimators.defaults import PRIOR, REFERENCE
from estimators.linear.fit_data import FitData
from estimators.linear.least_squares import RealArray, triangular_inverse, upper_triangle, whole_triangle
from estimators.linear.priors import prior_rows

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class NormalInverseGamma:
    """β | σ² ~ N(``mean``, σ² ``root`` rootᵀ), σ² ~ IG(ν/2, ν s²/2) with ν ``degrees_of_freedom`` and s ``scale``.

    β alone is Student-t on ν degrees of freedom with scale matrix s² root rootᵀ (Gelman et al., BDA3, §14.2).
    """

    mean: FloatArray
    root: FloatArray
    degrees_of_freedom: float
    scale: float

    @property
    def covariance(self) -> FloatArray:
        """Scale matrix of β's Student-t distribution."""
        return np.asarray(self.scale**2 * self.root @ self.root.T)

    def log_scale(self) -> tuple[float, float]:
        """Mean and standard deviation of log σ."""
        shape = 0.5 * self.degrees_of_freedom
        mean = np.log(self.scale) + 0.5 * (np.log(shape) - special.digamma(shape))
        return float(mean), float(0.5 * np.sqrt(special.polygamma(1, shape)))

    def draw(self, count: int, rng: np.random.Generator) -> FloatArray:
        """Independent draws [count, p + 1] of (β, σ)."""
        sigma = self.scale * np.sqrt(self.degrees_of_freedom / rng.chisquare(self.degrees_of_freedom, count))
        normal = rng.standard_normal((count, len(self.mean)))
        return np.column_stack([self.mean + sigma[:, None] * (normal @ self.root.T), sigma])


def posterior(triangle: RealArray, effective_n: float, prior: FloatArray) -> NormalInverseGamma:
    """Exact posterior from the data's triangle [4, 4] in (1, v, f_n | μ) and the prior's rows [3, 4]."""
    updated = upper_triangle(np.concatenate([prior.astype(np.longdouble), triangle]))
    root = triangular_inverse(updated[:-1, :-1])
    mean = (root @ updated[:-1, -1]).astype(float)
    degrees = PRIOR.degrees_of_freedom + effective_n
    square = PRIOR.degrees_of_freedom * REFERENCE.scatter**2 + float(updated[-1, -1]) ** 2
    return NormalInverseGamma(mean, root.astype(float), degrees, float(np.sqrt(square / degrees)))


def exact_posterior(data: FitData, width: float = PRIOR.width) -> NormalInverseGamma:
    """Exact posterior of the data, with a prior of the given width."""
    rows = prior_rows(data.element_area, replace(PRIOR, width=width))
    return posterior(whole_triangle(data.factor), data.effective_n, rows)
