"""Compiled algebra of a few columns or directions, for which calls of NumPy take longer than what they do.

Needs numba, which takes a while to load.
"""

import math

import numpy as np
from numpy.typing import NDArray

from slipcore.compilation import compiled

FloatArray = NDArray[np.float64]

EPSILON = float(np.finfo(float).eps)
TINY = float(np.finfo(float).tiny)
TURNS = 60
"""Of pairs of columns, at most: two or three make them orthogonal."""


@compiled
def turned_apart(columns: FloatArray) -> FloatArray:
    """Sizes [c] of the ``columns`` [k, c], which are turned among each other in place until they are orthogonal: then
    they are singular vectors times singular values (Hestenes, 1958, Journal of the SIAM 6:51).
    """
    count = columns.shape[1]
    square = np.empty(count)
    for _ in range(TURNS):
        turned = False
        for i in range(count):
            square[i] = 0.0
            for k in range(len(columns)):
                square[i] += columns[k, i] * columns[k, i]
        for i in range(count):
            for j in range(i + 1, count):
                across = 0.0
                for k in range(len(columns)):
                    across += columns[k, i] * columns[k, j]
                if abs(across) <= EPSILON * math.sqrt(square[i] * square[j]):
                    continue
                angle = 0.5 * math.atan2(2.0 * across, square[i] - square[j])
                cosine, sine = math.cos(angle), math.sin(angle)
                for k in range(len(columns)):
                    one, other = columns[k, i], columns[k, j]
                    columns[k, i], columns[k, j] = cosine * one + sine * other, cosine * other - sine * one
                turned = True
        if not turned:
            break
    return np.sqrt(square)


@compiled
def spanned(rows: FloatArray, alone: float) -> FloatArray:
    """Orthonormal columns [k, ≤ c] that span those of ``rows`` [k, c] which are not 0."""
    axes = rows.copy()
    for column in range(axes.shape[1]):
        size = 0.0
        for k in range(len(axes)):
            size += axes[k, column] * axes[k, column]
        for k in range(len(axes)):
            axes[k, column] /= math.sqrt(size) if size > 0.0 else 1.0
    parts = turned_apart(axes)
    found = np.empty((len(axes), np.count_nonzero(parts > alone)))
    place = 0
    for column in range(axes.shape[1]):
        if parts[column] > alone:
            for k in range(len(axes)):
                found[k, place] = axes[k, column] / parts[column]
            place += 1
    return found


@compiled
def power(square: FloatArray, exponent: float, alone: float) -> FloatArray:
    """Of a symmetric matrix [d, d] without negative parts, of which those of 0 stay 0."""
    directions, found = square.copy(), np.zeros_like(square)
    parts = turned_apart(directions)
    least = alone * parts.max()
    for k in range(len(parts)):
        if parts[k] > least:
            _add(found, directions, k, parts[k] ** exponent / parts[k] ** 2)
    return found


@compiled
def from_one(square: FloatArray, least: float, exponent: float) -> FloatArray:
    """The power of a symmetric matrix [d, d] without negative parts, of which those of up to ``least`` become 1."""
    directions, found = square.copy(), np.eye(len(square))
    parts = turned_apart(directions)
    for k in range(len(parts)):
        if parts[k] > least:
            _add(found, directions, k, (parts[k] ** exponent - 1.0) / parts[k] ** 2)
    return found


@compiled
def _add(square: FloatArray, columns: FloatArray, column: int, times: float) -> None:
    """Add the products of a column [d] of ``columns`` with itself to a ``square`` [d, d]."""
    for i in range(len(square)):
        for j in range(len(square)):
            square[i, j] += times * columns[i, column] * columns[j, column]


@compiled
def times(one: FloatArray, other: FloatArray) -> FloatArray:
    """Product [d, d] of two matrices [d, d]."""
    found = np.zeros_like(one)
    for i in range(len(one)):
        for j in range(len(one)):
            for k in range(len(one)):
                found[i, j] += one[i, k] * other[k, j]
    return found
