"""As how many independent places those of a grasp count, where neighbours are off alike."""

import numpy as np
from numpy.typing import NDArray

from estimators.defaults import CLUSTERS

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


def independent_share(mean: FloatArray, noise: FloatArray, element: IntArray) -> float:
    """The part of its places that a grasp counts as (Kish, 1965, ch. 8); 1 where chance explains their correlation.

    ``mean`` [p, 3] of (v, f_n, μ) of the places, ``noise`` [p] the variance that samples leave in their μ, ``element``
    [p] their row-major index, ascending. What the places lie off the plane of their grasp is correlated with c from
    element to next element of a row. As a field that falls off as a normal density does, c to the square of the
    distance, the mean of many such places has Σ c^(i² + j²) times the variance of independent ones (Cressie, 1993,
    §1.3). Of the noise, which no neighbours share, c is freed.
    """
    beside = np.flatnonzero(np.diff(element) == 1)
    if len(beside) < CLUSTERS.least_neighbours:
        return 1.0
    residual = _off_their_plane(mean)
    variance = float(residual @ residual) / len(residual)
    shared = float(residual[beside] @ residual[beside + 1]) / len(beside)
    if not shared > CLUSTERS.by_chance * variance / np.sqrt(len(beside)):
        return 1.0
    own = max(variance - float(noise.mean()), shared)
    line = _correlation_of_a_line(min(shared / own, CLUSTERS.most_alike), len(mean))
    times = 1.0 + own / variance * (line**2 - 1.0)
    return max(1.0 / times, CLUSTERS.least_places / len(mean))


def _correlation_of_a_line(neighbours: float, places: int) -> float:
    """Σ c^(i²) over the distances i to either side that so many places have."""
    distance = np.arange(1, places)
    return 1.0 + 2.0 * float((neighbours ** (distance.astype(float) ** 2)).sum())


def _off_their_plane(mean: FloatArray) -> FloatArray:
    """Residual [p] of μ on (1, v, f_n), with columns of one size."""
    columns = mean[:, :2] - mean[:, :2].mean(axis=0)
    size = np.linalg.norm(columns, axis=0)
    columns = np.column_stack([np.ones(len(mean)), columns / np.where(size > 0.0, size, 1.0)])
    friction = mean[:, 2] - mean[:, 2].mean()
    return np.asarray(friction - columns @ np.linalg.lstsq(columns, friction, rcond=None)[0])
