"""Whether the errors of an element's samples go together, as friction that differs from place to place makes them."""

import numpy as np
from numpy.typing import NDArray
from scipy.special import fdtrc

from estimators.defaults import CLUSTERS, REFERENCE
from estimators.linear.fit_data import FitData
from estimators.linear.least_squares import LinearFit, solve
from estimators.linear.observations import IntArray, Observations

FloatArray = NDArray[np.float64]


def shared_by_elements(data: FitData) -> float:
    """The part of the errors' variance within a grasp that is the same for all samples of an element; 0 if none shows.

    Intraclass correlation of the residuals, by analysis of variance: elements within grasps against samples within
    elements (Searle et al., 1992, ch. 3), where its F test rejects. 0 for moments, too, which know of no elements.
    """
    observations = data.observations
    if observations is None:
        return 0.0
    place, grasp = observations.place(), observations.grasp
    count = np.bincount(place)
    between, within = len(count) - np.count_nonzero(np.bincount(grasp)), len(place) - len(count)
    if between < 1 or within < 1:
        return 0.0
    linear = solve(data.factor, REFERENCE.spans(data.element_area))
    residual = observations.friction - plane(linear, observations)
    residual -= _means(grasp, residual)[grasp]
    element = _means(place, residual)
    inside = float(((residual - element[place]) ** 2).sum()) / within
    across = float(count @ element**2) / between
    if not inside > 0.0 or fdtrc(between, within, across / inside) > CLUSTERS.shared_level:
        return 0.0
    typical = (len(place) - float(count @ count) / len(place)) / max(len(count) - 1, 1)
    variance = (across - inside) / typical
    return variance / (variance + inside)


def _means(codes: IntArray, values: FloatArray) -> FloatArray:
    return np.asarray(np.bincount(codes, values) / np.maximum(np.bincount(codes), 1))


def plane(linear: LinearFit, observations: Observations) -> FloatArray:
    """Friction [k] that the coefficients expect of each sample."""
    beta = linear.coefficients.astype(float)
    return np.asarray(beta[0] + beta[1] * observations.tangential_velocity + beta[2] * observations.normal_force)
