"""The priors of every Bayesian method, in one place; the numbers stand in ``defaults``."""

import numpy as np
from numpy.typing import NDArray

from estimators.defaults import PRIOR, REFERENCE, Prior

FloatArray = NDArray[np.float64]


def prior_rows(element_area: float, prior: Prior = PRIOR) -> FloatArray:
    """The prior of β as rows [3, 4] of a least-squares problem in (1, v, f_n | μ), each with error σ."""
    precision = REFERENCE.scatter / prior.width * np.concatenate([[1.0], REFERENCE.spans(element_area)])
    rows = np.zeros((3, 4))
    rows[:, :3] = np.diag(precision)
    rows[0, 3] = precision[0] * REFERENCE.friction
    return rows


def log_half_student(value: FloatArray, scale: float) -> FloatArray:
    """Log density, up to a constant, of a half-Student-t on ``EFFECT_DEGREES`` degrees of freedom with ``scale``."""
    degrees = PRIOR.effect_degrees_of_freedom
    return np.asarray(-0.5 * (degrees + 1.0) * np.log1p((value / scale) ** 2 / degrees))


def conjugate_prior() -> str:
    """The normal-inverse-gamma prior in words and numbers."""
    return (
        f"beta | sigma ~ N(({REFERENCE.friction:g}, 0, 0), sigma^2 V0): at sigma = {REFERENCE.scatter:g} of sd "
        f"{PRIOR.width:g} in beta0 and in each slope times its span ({REFERENCE.tangential_velocity:g} m/s; "
        f"{REFERENCE.pressure:g} Pa times the element area); sigma^2 ~ IG({PRIOR.degrees_of_freedom / 2:g}, "
        f"{PRIOR.degrees_of_freedom / 2 * REFERENCE.scatter**2:g})"
    )


def positive_friction() -> str:
    """The conjugate prior, cut off where it would let friction be negative."""
    return conjugate_prior() + "; mean friction above 0 over the data's domain"


def grasp_effect() -> str:
    """The prior of a random intercept per cluster, beside the conjugate one."""
    return (
        conjugate_prior() + f"; intercepts of clusters ~ N(0, tau^2), tau ~ half-Student-t on "
        f"{PRIOR.effect_degrees_of_freedom:g} degrees of freedom with scale {REFERENCE.scatter:g}"
    )
