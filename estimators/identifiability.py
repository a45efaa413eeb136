"""Which coefficients the data do determine: judged by what their uncertainty does to friction."""

import numpy as np
from numpy.typing import NDArray
from scipy import special

from estimators.defaults import IDENTIFIABILITY, REFERENCE
from estimators.observations import Observations

FloatArray = NDArray[np.float64]


def spans(tangential_velocity: float, normal_force: float, element_area: float) -> FloatArray:
    """What each coefficient is multiplied by where it matters, [3]: 1, and the larger of the reference and the data."""
    return np.concatenate([[1.0], np.maximum(REFERENCE.spans(element_area), [tangential_velocity, normal_force])])


def effects(covariance: FloatArray, degrees_of_freedom: float, observations: Observations) -> FloatArray:
    """Half-width of each coefficient's 95 % interval as a change of μ over its span, in parts of the mean |μ|, [3].

    The span is the larger of the reference span and the largest v (f_n) seen, from zero: a slope that is known only
    over a sliver of v is not known for a planner.
    """
    span = spans(
        float(observations.tangential_velocity.max()), float(observations.normal_force.max()), observations.element_area
    )
    half = special.stdtrit(degrees_of_freedom, 0.975) * np.sqrt(np.diag(covariance)) * span
    mean = abs(float(np.average(observations.friction, weights=observations.weight)))
    return np.asarray(half / max(mean, np.finfo(float).tiny))


def identifiable(effect: FloatArray) -> NDArray[np.bool_]:
    """Whether each coefficient counts as known: its ``effect`` is at most ``IDENTIFIABILITY.effect``."""
    return np.asarray(effect <= IDENTIFIABILITY.effect)
