"""Errors of a record that last: how those of its stretches of time go together, by restricted likelihood.

Where errors last for a part of the record, what is left of them after a fit goes together less than they do: the fit
takes up what looks like its slopes. The likelihood of what no slope can take up (Patterson & Thompson, 1971, Biometrika
58:545; Harville, 1977, Journal of the American Statistical Association 72:320) allows for that.
"""

import numpy as np
from numpy.typing import NDArray

from estimators.defaults import CLUSTERS, LASTING, OWN_SHARES

FloatArray = NDArray[np.float64]

SPARE = 3
"""Stretches beyond what a fit of their levels takes up, from which the mean of their variance exists."""


def covariance_of_levels(level: FloatArray, design: FloatArray, weight: FloatArray) -> FloatArray:
    """Covariance [b, b] of the errors in the ``level`` [b] of each of b stretches, in their order and alike long.

    ``design`` [b, p]: orthonormal columns of what levels may follow that is no error; ``weight`` [b] of each. Errors
    are each stretch's own, as independent samples make them, or a part is, and the rest falls off exponentially with
    the time between stretches. How long it lasts and how large the part is (``LASTING``, ``OWN_SHARES``, each as
    likely before) are averaged over what the levels say of them, and the variance over a prior 1/σ². Takes at least
    p + ``SPARE`` stretches.
    """
    correlation = _correlations(weight)
    root = np.linalg.cholesky(correlation)
    white = np.linalg.solve(
        root, np.broadcast_to(np.column_stack([design, level]), (*root.shape[:2], len(design.T) + 1))
    )
    along, taken = np.linalg.qr(white[..., :-1])
    left = white[..., -1] - np.einsum("mbp,mcp,mc->mb", along, along, white[..., -1])
    degrees = level.size - design.shape[1]
    square = np.maximum(np.square(left).sum(axis=1), np.finfo(float).tiny)
    log_weight = -0.5 * degrees * np.log(square) - _log_size(root) - _log_size(taken)
    log_weight[0] += np.log(CLUSTERS.independent / (1.0 - CLUSTERS.independent) * (len(log_weight) - 1))
    likely = np.exp(log_weight - log_weight.max())
    return np.asarray(np.tensordot(likely / likely.sum() * square / (degrees - 2), correlation, 1))


def _correlations(weight: FloatArray) -> FloatArray:
    """Of independent errors, and of those that last for each time and are their own to each part, [1 + m, b, b]."""
    apart = np.abs(np.subtract.outer(np.arange(len(weight)), np.arange(len(weight))))
    lasting = np.exp(-apart / np.array(LASTING)[:, None, None])
    own, share = np.diag(weight.mean() / weight), np.array(OWN_SHARES)[:, None, None, None]
    return np.concatenate([own[None], ((1.0 - share) * lasting + share * own).reshape(-1, *apart.shape)])


def _log_size(triangle: NDArray[np.floating]) -> FloatArray:
    """Logarithm of the size of the determinants of triangles [m, k, k], [m]."""
    return np.asarray(np.log(np.abs(np.diagonal(triangle, axis1=1, axis2=2))).sum(axis=1))
