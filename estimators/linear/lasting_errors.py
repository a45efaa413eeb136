"""Errors of a grasp that last: how those of a place's stretches of time go together, by restricted likelihood.

Where errors last for a part of the record, what is left of them after a fit goes together less than they do: the fit
takes up what looks like its slopes. The likelihood of what no slope can take up (Patterson & Thompson, 1971, Biometrika
58:545; Harville, 1977, Journal of the American Statistical Association 72:320) allows for that.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from estimators.defaults import CLUSTERS, LASTING, OWN_SHARES

FloatArray = NDArray[np.float64]

SPARE = 3
"""Levels beyond what a fit of them takes up, from which the mean of their variance exists."""
LASTS = np.array([1.0, *(lasts for lasts in LASTING for _ in OWN_SHARES)])
OWN = np.array([1.0, *(own for _ in LASTING for own in OWN_SHARES)])
"""How long errors last and the part of their variance that each stretch has for itself; first all of it."""


class LevelErrors(NamedTuple):
    """Covariances of the errors in the levels of p places: of those that are ``own`` to each of b stretches, [p, b],
    and of those that are ``lasting``, [b, b], the same in each place.
    """

    own: FloatArray
    lasting: FloatArray


def errors_of_levels(level: FloatArray, design: FloatArray, weight: FloatArray) -> LevelErrors:
    """Of the ``level`` [p, b] of each of b stretches of p places, alike long and in their order.

    Of a level of ``weight`` [p, b] 0 nothing was seen. ``design`` [p, b, d]: columns of full rank of what the levels of
    all places may follow, beside the mean of each place, that is no error. Errors of places are independent. Those of
    one are each stretch's own, as independent samples make them, or a part is, and the rest falls off exponentially
    with the time between stretches. How long it lasts and how large the part is (``LASTING``, ``OWN_SHARES``, each as
    likely before) are averaged over what the levels say of them, and the variance over a prior 1/σ². Takes at least
    p + d + ``SPARE`` levels.
    """
    from estimators.linear.whitened_levels import whitened  # numba takes a while to load

    seen = weight > 0.0
    own = np.divide(weight[seen].mean(), weight, out=np.zeros_like(weight), where=seen)
    rows = np.concatenate([np.ones((*level.shape, 1)), design, level[..., None]], axis=2)
    products, log_size = whitened(np.ascontiguousarray(rows), np.ascontiguousarray(own), np.exp(-1.0 / LASTS), OWN)
    square, log_taken = _left(products)
    degrees = np.count_nonzero(seen) - len(level) - design.shape[2]
    square = np.maximum(square, np.finfo(float).tiny)
    log_weight = -0.5 * degrees * np.log(square) - log_size - log_taken
    log_weight[0] += np.log(CLUSTERS.independent / (1.0 - CLUSTERS.independent) * (len(LASTS) - 1))
    likely = np.exp(log_weight - log_weight.max())
    variance = likely / likely.sum() * square / (degrees - 2)
    later = np.arange(level.shape[1])
    lasting = (variance * (1.0 - OWN)) @ np.exp(-later / LASTS[:, None])
    return LevelErrors(variance @ OWN * own, np.asarray(lasting[np.abs(np.subtract.outer(later, later))]))


def _left(products: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Of the ``products`` [m, c, c] of columns, the square [m] of the last one with all others taken out, and the
    logarithm [m] of the size of what is taken.
    """
    taken, along = products[:, :-1, :-1], products[:, :-1, -1:]
    square = products[:, -1, -1] - (along * np.linalg.solve(taken, along)).sum(axis=(1, 2))
    return square, np.asarray(0.5 * np.linalg.slogdet(taken)[1])
