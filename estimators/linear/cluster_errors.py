"""Standard errors where samples share errors (CR2) and their degrees of freedom, from sums over clusters."""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from estimators.defaults import CLUSTERS

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


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


def cluster_robust(square: FloatArray, score: FloatArray, scale: float) -> FloatArray:
    """Covariance [r, r] of Qᵀy when errors are shared within clusters.

    CR2 of Bell & McCaffrey (2002), Σ A_g s_g s_g' A_g with A_g = (I − Q_g'Q_g)^{-1/2}, is unbiased where errors are
    independent after all. But G clusters span G − 1 directions at most, and a direction that one cluster alone
    determines leaves no residual: both would come out as *certain*. So with fewer than ``few`` clusters a direction no
    direction is given less than the classical variance, with fewer clusters than directions + 2 none less than the
    mean over directions; and however many they are, a direction that one of them dominates is given no less than the
    worst has: how far a cluster is off as a whole, only the others show.
    """
    count, size = score.shape
    values, vectors = np.linalg.eigh(square)
    moved = np.einsum("gij,gj,gkj,gk->gi", vectors, _inverse_root(values), vectors, score, optimize=True)
    covariance = moved.T @ moved
    worst = max(scale**2, float(np.linalg.eigvalsh(covariance)[-1]))
    if count < CLUSTERS.few * size:
        covariance = _raise_all(
            covariance, scale**2 if count >= size + 2 else max(scale**2, np.trace(covariance) / size)
        )
    return _raise_dominated(covariance, values[:, -1], vectors[..., -1], worst)


def satterthwaite(square: FloatArray, contrasts: FloatArray) -> FloatArray:
    """Degrees of freedom [k] of the CR2 variance of contrasts [k, r] of Qᵀy, were errors independent.

    The variance is a quadratic form in normal errors, (tr Γ)²/tr Γ² χ² as Bell & McCaffrey (2002) and Pustejovsky &
    Tipton (2018, eq. 11) match it; Γ_gh = δ_gh w_g'Q_g'Q_g w_g − z_g'z_h with w_g = A_g c and z_g = Q_g'Q_g w_g. Where
    few clusters, or clusters that differ, determine a contrast, it is far below G − 1.
    """
    values, vectors = np.linalg.eigh(square)
    along = np.einsum("gij,ki->kgj", vectors, contrasts)
    turned = along * (values * _inverse_root(values))
    own = np.einsum("kgj,kgj,gj->kg", along, along, values * _inverse_root(values) ** 2)
    z = np.einsum("gij,kgj->kgi", vectors, turned)
    shared = np.einsum("kgi,kgi->kg", z, z)
    cross = np.einsum("kgi,kgj->kij", z, z)
    trace = (own - shared).sum(axis=1)
    squares = (own**2 - 2.0 * own * shared).sum(axis=1) + np.einsum("kij,kij->k", cross, cross)
    return np.maximum(np.where(squares > 0.0, trace**2 / np.where(squares > 0.0, squares, 1.0), 1.0), 1.0)


def _inverse_root(values: FloatArray) -> FloatArray:
    """(1 − value)^{-1/2}, and 0 where a cluster alone determines a direction."""
    remainder = 1.0 - values
    return np.where(remainder > CLUSTERS.alone, 1.0 / np.sqrt(np.maximum(remainder, CLUSTERS.alone)), 0.0)


def _raise_all(covariance: FloatArray, least: float) -> FloatArray:
    """At least this variance along every direction."""
    values, vectors = np.linalg.eigh(covariance)
    return np.asarray((vectors * np.maximum(values, least)) @ vectors.T)


def _raise_dominated(covariance: FloatArray, share: FloatArray, direction: FloatArray, least: float) -> FloatArray:
    """At least this variance along the directions of which one cluster alone holds most of what is known."""
    for u in direction[share > CLUSTERS.dominant]:
        covariance = covariance + max(0.0, least - float(u @ covariance @ u)) * np.outer(u, u)
    return covariance
