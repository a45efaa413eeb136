"""Which coefficients the data do determine: judged by what their uncertainty does to friction."""

import numpy as np
from numpy.typing import NDArray
from scipy import special

from estimators.defaults import IDENTIFIABILITY, REFERENCE
from estimators.linear.fit_data import FitData

FloatArray = NDArray[np.float64]

ONE_RECORD_ADVICE = (
    "all samples are of one grasp at one place, in which an error that lasts looks like an effect of velocity or of "
    "normal force: to know β₁ and β₂ record several grasps, or more places at once"
)
FEW_PLACES_ADVICE = (
    "all samples are of one grasp, at places too few to show what errors that last in each of them do to β₁ and "
    "β₂: to know these record several grasps, or more places at once"
)
INDEPENDENT_ADVICE = (
    "all samples are of one grasp, whose errors may last, and this method takes them as independent, so that β₁ and "
    "β₂ may be off by more than their intervals: fit by auto, or ols to the samples themselves"
)


def effects(covariance: FloatArray, degrees_of_freedom: float, data: FitData) -> FloatArray:
    """Half-width of each coefficient's 95 % interval as a change of μ over its span, in parts of the mean |μ|, [3].

    The span is the larger of the reference span and the largest v (f_n) seen, from zero: a slope that is known only
    over a sliver of v is not known for a planner.
    """
    largest = np.array([data.domain.tangential_velocity[1], data.domain.normal_force[1]])
    span = np.concatenate([[1.0], np.maximum(REFERENCE.spans(data.element_area), largest)])
    half = special.stdtrit(degrees_of_freedom, IDENTIFIABILITY.ends[1]) * np.sqrt(np.diag(covariance)) * span
    mean = abs(data.mean_friction)
    return np.asarray(half / max(mean, np.finfo(float).tiny))


def identifiable(effect: FloatArray, prior_shift: FloatArray, *, slopes_open: bool = False) -> NDArray[np.bool_]:
    """Whether each coefficient counts as known: its effect is small, and it is the data's rather than the prior's.

    ``slopes_open``: all samples are of one grasp whose errors may last as long as v and f_n vary, at one place, where
    no interval rules it out, or by a method that takes them as independent: its slopes do not count as known.
    """
    known = (effect <= IDENTIFIABILITY.effect) & (prior_shift <= IDENTIFIABILITY.prior_shift)
    return np.asarray(known & np.array([True, not slopes_open, not slopes_open]))


def takes_as_independent(method: str, data: FitData) -> bool:
    """Whether a method takes the errors of a single grasp as independent: ``ols`` sees elements in samples alone."""
    return data.of_one_grasp and (method == "conjugate" or (method == "ols" and data.observations is None))


def what_to_record(known: NDArray[np.bool_], method: str, data: FitData) -> str | None:
    """In a sentence, where it is one grasp whose errors may last that leaves slopes unknown."""
    if data.of_one_record:
        return ONE_RECORD_ADVICE
    if takes_as_independent(method, data):
        return INDEPENDENT_ADVICE
    return FEW_PLACES_ADVICE if not known[1:].all() and data.places_leave_open() else None
