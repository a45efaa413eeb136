"""The priors of every Bayesian method, in one place; the numbers stand in ``defaults``."""

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy import special

from estimators.arguments import above_zero, check_number, check_whole
from estimators.defaults import POPULATION, PRIOR, REFERENCE, Prior
from estimators.friction_model import Domain
from estimators.linear.normal_mixture import mixture_quantile

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class ScatterPrior:
    """Half-Student-t prior of the scatter τ between grasps, as a part of friction.

    By Gelman (2006, Bayesian Analysis 1:515). The weak default, unless learnt from so many other ``materials``: see
    ``estimators.population_scatter``. Raises ``InvalidSamples`` for a scale that is not above 0, or degrees of freedom
    below 1.
    """

    scale: float = field(default_factory=lambda: PRIOR.grasp_scatter)
    degrees_of_freedom: float = field(default_factory=lambda: PRIOR.grasp_degrees_of_freedom)
    materials: int = 0

    def __post_init__(self) -> None:
        where = "of the prior of scatter"
        check_number(f"scale {where}", self.scale, above_zero, "above 0 and finite")
        name = f"degrees_of_freedom {where}"
        check_number(name, self.degrees_of_freedom, lambda value: 1.0 <= value < math.inf, "1 or more")
        check_whole(f"materials {where}", self.materials, 0)

    def __str__(self) -> str:
        law = f"tau ~ half-Student-t on {self.degrees_of_freedom:.3g} degrees of freedom with scale {self.scale:.3g}"
        if self.materials:
            return f"{law}, from {self.materials} other material{'s' * (self.materials > 1)}"
        return f"{law}, the default" if self == ScatterPrior() else law

    def log_density(self, tau: FloatArray) -> FloatArray:
        """Of τ, up to a constant."""
        return log_half_student(tau, self.scale, self.degrees_of_freedom)

    def effect_quantile(self, level: float) -> float:
        """Quantile of u ~ N(0, τ²), by which part a grasp differs from the others: over quantiles of τ."""
        part = (np.arange(POPULATION.quantiles) + 0.5) / POPULATION.quantiles
        tau = np.asarray(self.scale * special.stdtrit(self.degrees_of_freedom, 0.5 * (1.0 + part)), dtype=float)
        weight = np.full(len(tau), 1.0 / len(tau))
        return float(mixture_quantile(weight, np.zeros(len(tau)), tau, level)[0])


WEAK = ScatterPrior()
"""Where no other material shows how much grasps differ."""


def prior_rows(element_area: float, prior: Prior = PRIOR) -> FloatArray:
    """The prior of β as rows [3, 4] of a least-squares problem in (1, v, f_n | μ), each with error σ."""
    precision = REFERENCE.scatter / prior.width * np.concatenate([[1.0], REFERENCE.spans(element_area)])
    rows = np.zeros((3, 4))
    rows[:, :3] = np.diag(precision)
    rows[0, 3] = precision[0] * REFERENCE.friction
    return rows


def weak_spans(domain: Domain, element_area: float) -> FloatArray:
    """Spans [2] of v and f_n over which a slope has the prior's width: the reference's, or less where less was seen.

    Over a sliver of v or f_n a prior made for millimetres a second and for newtons would be strong.
    """
    seen = np.array([domain.tangential_velocity, domain.normal_force])
    width = np.maximum(seen[:, 1] - seen[:, 0], PRIOR.least_span * seen[:, 1])
    spans = REFERENCE.spans(element_area)
    return np.where(width > 0.0, np.minimum(spans, width), spans)


def log_half_student(value: FloatArray, scale: float, degrees: float = PRIOR.effect_degrees_of_freedom) -> FloatArray:
    """Log density, up to a constant, of a half-Student-t on so many degrees of freedom with ``scale``."""
    return np.asarray(-0.5 * (degrees + 1.0) * np.log1p((value / scale) ** 2 / degrees))


def conjugate_prior() -> str:
    """The normal-inverse-gamma prior in words and numbers."""
    return (
        f"beta | sigma ~ N(({REFERENCE.friction:g}, 0, 0), sigma^2 V0): at sigma = {REFERENCE.scatter:g} of sd "
        f"{PRIOR.width:g} in beta0 and in each slope times its span ({REFERENCE.tangential_velocity:g} m/s; "
        f"{REFERENCE.pressure:g} Pa times the element area); {_of_scatter()}"
    )


def _of_scatter() -> str:
    shape = PRIOR.degrees_of_freedom / 2
    return f"sigma^2 ~ IG({shape:g}, {shape * REFERENCE.scatter**2:g})"


def positive_friction() -> str:
    """The conjugate prior, cut off where it would let friction be negative."""
    return conjugate_prior() + "; mean friction above 0 over the data's domain"


def structured(scatter_prior: ScatterPrior = WEAK, sensors: int = 1, slope: float = 0.0) -> str:
    """The prior of the hierarchical model of grasps of so many ``sensors``, in words and numbers.

    ``slope``: the precision, (m/s)², of a further prior of β₁ (``assumed_slope``); 0 where there is none.
    """
    assumed = f"beta1 ~ N(0, ({1.0 / math.sqrt(slope):.3g} s/m)^2) besides; " if slope > 0.0 else ""
    gains = (
        f"between sensors kappa ~ half-Student-t on {PRIOR.sensor_degrees_of_freedom:g} with scale "
        f"{PRIOR.sensor_scatter:g}; "
    )
    return (
        f"friction at the mean of the data ~ N({REFERENCE.friction:g}, {PRIOR.width:g}^2), each slope times its span "
        f"~ N(0, {PRIOR.width:g}^2), the spans {REFERENCE.tangential_velocity:g} m/s and {REFERENCE.pressure:g} Pa "
        f"times the element area, or the range seen if less; {assumed}between grasps {scatter_prior}; "
        f"{gains if sensors > 1 else ''}between places omega ~ "
        f"half-Student-t on {PRIOR.effect_degrees_of_freedom:g} with scale {REFERENCE.scatter:g}; {_of_scatter()}"
    )
