"""The recommended method: the hierarchical model, unless samples lie far off; least squares beside it as a check."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from estimators.defaults import AUTOMATIC, NORMAL_MAD
from estimators.friction_model import FrictionModel
from estimators.linear.fit_data import FitData
from estimators.linear.m_estimate import LOSSES, m_estimate
from estimators.linear.observations import IntArray, Observations
from estimators.linear.shared_errors import plane
from estimators.methods import ols

FloatArray = NDArray[np.float64]


class Choice(NamedTuple):
    """The data for the hierarchical model, all or without what lies far off, and the reason in words and numbers."""

    data: FitData
    reason: str


def choose(data: FitData) -> Choice:
    """All data for the hierarchical model, or those that are friction at all.

    What is shared within a grasp or a place widens the hierarchical model's scales and nothing else; false slip biases
    it. Only samples show that: moments are taken as they are.
    """
    if data.observations is not None:
        distance = distances(data, data.observations)
        part = float(np.average(distance > AUTOMATIC.half_weight, weights=data.observations.weight))
        if part > AUTOMATIC.downweighted and part * data.n >= AUTOMATIC.least_outliers:
            near = distance <= AUTOMATIC.far
            reason = f"{part:.1%} of the samples lie far off their place; normal errors leave 1.1%"
            return Choice(
                data.kept(near), f"{reason}; without the {np.count_nonzero(~near)} beyond {AUTOMATIC.far:g} deviations"
            )
    return Choice(data, "friction may scatter between grasps, between places and within them")


def distances(data: FitData, observations: Observations) -> FloatArray:
    """How far each sample [k] lies from the robust plane, in standard deviations, what is its place's taken away.

    Where most samples are of places with many, the others count as near; else all are judged by their distance from
    the plane, what is their grasp's taken away: a place with few samples cannot be judged by them. Where hardly
    anything scatters, what lies off by less than a grip could notice is near (``least_scatter``).
    """
    linear = m_estimate(data, observations, LOSSES["tukey"]).linear
    law = plane(linear, observations)
    residual = observations.friction - law
    place = observations.place()
    known = np.bincount(place)[place] >= AUTOMATIC.fewest
    if 2 * np.count_nonzero(known) > len(known):
        residual = np.where(known, residual - _medians(place, residual)[place], 0.0)
        known &= residual != 0.0  # a median's own distance of 0 says nothing of the scatter
    else:
        residual, known = _within_grasps(observations, law), np.ones(len(known), dtype=bool)
    scale = float(np.median(np.abs(residual[known]))) / NORMAL_MAD if known.any() else 0.0
    scale = max(scale, AUTOMATIC.least_scatter * float(np.median(np.abs(observations.friction))))
    return np.asarray(np.abs(residual) / scale if scale > 0.0 else np.zeros(len(residual)))


def _within_grasps(observations: Observations, law: FloatArray) -> FloatArray:
    """Residuals [k] from the law [k] as each grasp of several shows it: by which part of it they differ is scatter
    between grasps, however large it is.
    """
    friction, grasp = observations.friction, observations.grasp
    many = np.bincount(grasp)[grasp] >= AUTOMATIC.fewest
    if not grasp.any():
        return friction - law
    part = np.divide(friction, law, out=np.ones_like(law), where=law > 0.0)
    return np.asarray(friction - np.where(many, _medians(grasp, part)[grasp], 1.0) * law)


def _medians(codes: IntArray, values: FloatArray) -> FloatArray:
    """The median of the values of each code, the lower of two where their number is even."""
    order = np.lexsort((values, codes))
    count = np.bincount(codes)
    first = np.cumsum(count) - count
    return np.asarray(values[order][first + (count - 1) // 2])


def compared(model: FrictionModel, data: FitData) -> str:
    """Whether least squares agrees with the model, in a sentence: whether 95 % intervals of a coefficient miss."""
    other = ols.fit(data)
    (low, high), (lowest, highest) = model.interval().T, other.interval().T
    apart = [f"beta{k}" for k in np.flatnonzero((low > highest) | (lowest > high))]
    if not apart:
        return "least squares with cluster-robust errors agrees"
    return f"least squares disagrees by more than both intervals allow on {', '.join(apart)}: look at the samples"
