"""Standard errors where samples share errors: the cluster jackknife (CR3), from sums over clusters."""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

FEW = 3
"""Clusters a direction from which the jackknife stands alone: 9 clusters for the three coefficients."""

DOMINANT = 0.8
"""Share of the information on a direction above which the cluster that holds it is alone there."""


def cluster_sums(
    blocks: Iterable[tuple[FloatArray, FloatArray, IntArray]], count: int
) -> tuple[FloatArray, FloatArray]:
    """Per cluster, Q'Q [count, r, r] and Q'e [count, r] of blocks (Q [n, r], e [n], cluster [n]).

    Q is an orthonormal design, e its residuals.
    """
    sums = [_block_sums(*block, count) for block in blocks]
    return np.sum([square for square, _ in sums], axis=0), np.sum([score for _, score in sums], axis=0)


def _block_sums(
    design: FloatArray, residual: FloatArray, cluster: IntArray, count: int
) -> tuple[FloatArray, FloatArray]:
    size = design.shape[1]
    square = np.empty((count, size, size))
    for i in range(size):
        for j in range(i, size):
            square[:, i, j] = square[:, j, i] = np.bincount(cluster, design[:, i] * design[:, j], count)
    score = np.stack([np.bincount(cluster, column * residual, count) for column in design.T], axis=1).astype(float)
    return square, score


def jackknife(square: FloatArray, score: FloatArray, scale: float) -> FloatArray:
    """Covariance [r, r] of Qᵀy when errors are shared within clusters.

    CR3 of Bell & McCaffrey (2002), (G − 1)/G Σ (I − Q_g'Q_g)⁻¹ s_g s_g' (I − Q_g'Q_g)⁻¹, is the jackknife over
    clusters and errs on the wide side when there are few. But G clusters span G − 1 directions at most, and a
    direction that one cluster alone determines has no jackknife: both would come out as *certain*. So with fewer than
    ``FEW`` clusters a direction no direction is given less than the classical variance, with fewer clusters than
    directions + 2 none less than the mean over directions; and however many they are, a direction that one of them
    dominates is given no less than the worst has: how far a cluster is off as a whole, only the others tell.
    """
    count, size = score.shape
    values, vectors = np.linalg.eigh(square)
    remainder = 1.0 - values
    inverse = np.where(remainder > 1e-8, 1.0 / np.maximum(remainder, 1e-8), 0.0)
    moved = np.einsum("gij,gj,gkj,gk->gi", vectors, inverse, vectors, score, optimize=True)
    covariance = (count - 1) / count * moved.T @ moved
    worst = max(scale**2, float(np.linalg.eigvalsh(covariance)[-1]))
    if count < FEW * size:
        covariance = _raise_all(
            covariance, scale**2 if count >= size + 2 else max(scale**2, np.trace(covariance) / size)
        )
    return _raise_dominated(covariance, values[:, -1], vectors[..., -1], worst)


def _raise_all(covariance: FloatArray, least: float) -> FloatArray:
    """At least this variance along every direction."""
    values, vectors = np.linalg.eigh(covariance)
    return np.asarray((vectors * np.maximum(values, least)) @ vectors.T)


def _raise_dominated(covariance: FloatArray, share: FloatArray, direction: FloatArray, least: float) -> FloatArray:
    """At least this variance along the directions of which one cluster alone holds most of what is known."""
    for u in direction[share > DOMINANT]:
        covariance = covariance + max(0.0, least - float(u @ covariance @ u)) * np.outer(u, u)
    return covariance
