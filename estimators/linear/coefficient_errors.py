"""Errors of coefficients where samples share errors: a covariance and degrees of freedom that fit each coefficient."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import special

from estimators.defaults import IDENTIFIABILITY
from estimators.linear.cluster_errors import cluster_robust, satterthwaite
from estimators.linear.least_squares import LinearFit
from estimators.linear.orthonormal import in_coefficients
from estimators.linear.priors import WEAK

FloatArray = NDArray[np.float64]


class CoefficientErrors(NamedTuple):
    """``covariance`` [3, 3], the scale matrix of a Student-t on ``degrees_of_freedom``, with which the 95 % interval of
    each coefficient is that of its ``standard`` error [3] on its own ``degrees`` [3].

    ``degrees_of_freedom`` are those of friction at the mean of the data.
    """

    covariance: FloatArray
    degrees_of_freedom: float
    degrees: FloatArray
    standard: FloatArray


def clustered_errors(
    linear: LinearFit, square: FloatArray, score: FloatArray, scale: float, most: float
) -> CoefficientErrors:
    """CR2 errors with Satterthwaite's degrees of freedom, at ``most`` those of the residuals.

    ``square`` [g, r, r] and ``score`` [g, r]: as from ``cluster_sums``.
    """
    root = linear.root.astype(float)
    at_mean = np.eye(1, root.shape[1])
    known = np.linalg.norm(root, axis=1, keepdims=True) > 0.0
    found = satterthwaite(square, np.concatenate([at_mean, np.where(known, root, at_mean)]))
    freedom, degrees = min(float(found[0]), most), np.minimum(found[1:], most)
    covariance = cluster_robust(square, score, scale)
    ratio = special.stdtrit(degrees, IDENTIFIABILITY.ends[1]) / special.stdtrit(freedom, IDENTIFIABILITY.ends[1])
    scaled = linear.prior_covariance + np.outer(ratio, ratio) * (root @ covariance @ root.T)
    return CoefficientErrors(scaled, freedom, degrees, np.sqrt(np.diag(in_coefficients(linear, covariance))))


def of_any_grasp(errors: CoefficientErrors, coefficients: NDArray[np.floating]) -> CoefficientErrors:
    """The errors of a law that one grasp alone shows, as it holds of grasps on average.

    A grasp's friction is 1 + u times that law, and only others show how large u may be: it is as the weak prior of the
    scatter between grasps expects, and its 95 % interval adds to that of each coefficient as root of squares. The
    ``standard`` errors stay those within the grasp.
    """
    upper = IDENTIFIABILITY.ends[1]
    part = WEAK.effect_quantile(upper) / float(special.stdtrit(errors.degrees_of_freedom, upper))
    along = part * np.asarray(coefficients, dtype=float)
    return errors._replace(covariance=errors.covariance + np.outer(along, along))
