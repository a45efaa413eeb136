"""Least squares from a triangular factor about the mean: nothing is squared, and rank is looked at before solving."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lapack

from estimators.defaults import IDENTIFIABILITY, LINEAR

FloatArray = NDArray[np.float64]
RealArray = NDArray[np.floating]


@dataclass(frozen=True, slots=True, eq=False)
class Factor:
    """Columns z = (regressors, response), [k], as their total weight, weighted mean and triangular factor about it.

    ``triangle`` [k, k] is upper triangular with a diagonal ≥ 0 and ``triangle.T @ triangle`` = Σ w (z − m)(z − m)ᵀ. A
    factor made without intercept has weight and mean 0. Real numbers of either precision.
    """

    weight: float
    mean: RealArray
    triangle: RealArray


@dataclass(frozen=True, slots=True, eq=False)
class LinearFit:
    """Solution of a least-squares problem with p regressors of which ``rank`` add a direction of their own.

    ``coefficients`` [p + 1] (intercept first; [p] without one); ``root`` [·, 1 + rank]: unscaled covariance =
    root rootᵀ; ``prior_covariance`` [·, ·] along what the data say nothing of (0 at full rank); ``residual_norm``
    √Σwe²; ``condition`` of the equilibrated regressors about their mean; ``inflation`` [p]: variance inflation;
    ``mean`` [p] and ``basis`` [p, rank]: (1/√W, (x − mean) basis) is the orthonormal design that ``root`` belongs to.
    """

    coefficients: RealArray
    root: RealArray
    prior_covariance: FloatArray
    residual_norm: float
    rank: int
    condition: float
    inflation: FloatArray
    mean: RealArray
    basis: RealArray


def factorise(columns: RealArray, weight: FloatArray | None = None, intercept: bool = True) -> Factor:
    """Factor of the columns [n, k], again in extended precision where their condition asks for it.

    Extended precision is ``np.longdouble``: 64 bits of mantissa on x86-64; where a platform has none, plain double.
    Columns that come as ``longdouble`` are taken at their full precision.
    """
    factor = merge(_chunks(columns, weight, intercept, columns.dtype))
    if condition_number(factor.triangle[:-1, :-1]) > IDENTIFIABILITY.ill_conditioned:
        return merge(_chunks(columns, weight, intercept, np.dtype(np.longdouble)))
    return factor


def merge(factors: Iterable[Factor]) -> Factor:
    """Factor of all rows behind the given ones; any order and any grouping agree to rounding.

    Rows √w(m − m̄) carry what the means differ by, so no large offset enters the triangle.
    """
    parts = list(factors)
    weight = np.array([part.weight for part in parts])
    means = np.array([part.mean for part in parts])
    total = weight.sum()
    mean = weight @ means / total if total > 0.0 else means[0]
    between = np.sqrt(weight)[:, None] * (means - mean)
    rows = np.concatenate([*(part.triangle for part in parts), between])
    return Factor(float(total), mean, upper_triangle(rows))


def whole_triangle(factor: Factor) -> RealArray:
    """Triangle [k + 1, k + 1] of (1, columns) from the one about the mean."""
    size = len(factor.mean) + 1
    whole = np.zeros((size, size), dtype=np.longdouble)
    whole[0] = np.sqrt(np.longdouble(factor.weight)) * np.concatenate([[1.0], factor.mean])
    whole[1:, 1:] = factor.triangle
    return np.asarray(whole)


def solve(factor: Factor, spans: FloatArray | None = None, scale: float = 1.0) -> LinearFit:
    """Least squares of the last column on the others and, where the factor has a weight, an intercept.

    Where regressors are constant or collinear the slopes in the directions that the data say nothing of are those of
    a prior N(0, 1/span²) (``spans`` [p], default 1): the smallest slopes, in units of 1/span, that fit. ``scale``
    multiplies the rows' weights (Σw → scale·Σw), as a change of their unit would.
    """
    triangle = factor.triangle.astype(np.longdouble) * np.sqrt(np.longdouble(scale))
    mean = factor.mean.astype(np.longdouble)
    regressors, response = triangle[:-1, :-1].copy(), triangle[:-1, -1]
    _blank_constant(regressors, mean[:-1], factor.weight * scale)
    seen = _directions(regressors, response)
    null, root = _least_prior(seen, np.ones(len(regressors)) if spans is None else spans)
    slopes = coefficients = root @ seen.response
    residual = np.hypot(_missed(regressors, response, seen), triangle[-1, -1])
    if factor.weight > 0.0:
        coefficients = np.concatenate([[mean[-1] - mean[:-1] @ slopes], slopes])
        root = _with_intercept(root, mean[:-1], 1.0 / np.sqrt(np.longdouble(factor.weight * scale)))
        null = np.vstack([-mean[:-1].astype(float) @ null, null])
    return LinearFit(
        coefficients=coefficients,
        root=root,
        prior_covariance=null @ null.T,
        residual_norm=float(residual),
        rank=seen.rank,
        condition=seen.condition,
        inflation=_inflation(regressors, seen),
        mean=mean[:-1],
        basis=seen.basis,
    )


def equilibrate(triangle: RealArray) -> tuple[FloatArray, FloatArray]:
    """The columns of a triangle scaled to norm 1, and their norms (1 where a column is zero)."""
    norms = np.sqrt(np.sum(np.square(triangle), axis=0)).astype(float)
    norms[norms == 0.0] = 1.0
    return (triangle / norms).astype(float), norms


def condition_number(triangle: RealArray) -> float:
    """Condition number after scaling the columns to norm 1; at most ``unbounded``."""
    values = np.linalg.svd(equilibrate(triangle)[0], compute_uv=False)
    return float(values[0] / max(values[-1], values[0] / LINEAR.unbounded)) if len(values) and values[0] > 0.0 else 1.0


def _chunks(
    columns: RealArray, weight: FloatArray | None, intercept: bool, precision: np.dtype[np.floating]
) -> Iterator[Factor]:
    for start in range(0, len(columns), LINEAR.chunk):
        rows = slice(start, start + LINEAR.chunk)
        yield _block(columns[rows].astype(precision), None if weight is None else weight[rows], intercept)


def _block(rows: RealArray, weight: FloatArray | None, intercept: bool) -> Factor:
    """Factor of some rows, which it overwrites."""
    share = np.ones(len(rows)) if weight is None else weight
    total, mean = 0.0, np.zeros(rows.shape[1], dtype=rows.dtype)
    if intercept:
        total = float(share.sum())
        for _ in range(2):  # the second pass takes away what rounding of a large mean left
            shift = share @ rows / total
            rows -= shift
            mean += shift
    if weight is not None:
        rows *= np.sqrt(weight).astype(rows.dtype)[:, None]
    return Factor(total, mean, upper_triangle(rows))


def upper_triangle(rows: RealArray) -> RealArray:
    """Upper triangular factor [k, k] of rows [n, k] with a diagonal ≥ 0; zero rows where n < k."""
    size = rows.shape[1]
    if len(rows) < size:
        rows = np.concatenate([rows, np.zeros((size - len(rows), size), dtype=rows.dtype)])
    if rows.dtype == np.longdouble:
        upper = _householder(rows)
    else:
        upper = np.triu(lapack.dgeqrf(np.asfortranarray(rows))[0][:size])
    return upper * np.where(np.diag(upper) < 0.0, -1.0, 1.0)[:, None]


def _householder(rows: RealArray) -> RealArray:
    """Householder QR in the precision of the rows, for what LAPACK does not know (Golub & Van Loan, alg. 5.2.1)."""
    a = rows.copy()
    size = a.shape[1]
    for j in range(size):
        v = a[j:, j].copy()
        v[0] += np.copysign(np.sqrt(v @ v), v[0])
        square = v @ v
        if square > 0.0:
            a[j:, j:] -= np.outer(v, 2.0 * (v @ a[j:, j:]) / square)
    return np.asarray(np.triu(a[:size]))


def _blank_constant(regressors: RealArray, mean: RealArray, weight: float) -> None:
    """Set to zero, in place, the columns whose spread is nothing but the rounding of their mean."""
    norms = np.sqrt(np.sum(np.square(regressors), axis=0))
    regressors[:, norms <= IDENTIFIABILITY.rounding * np.finfo(np.float64).eps * np.sqrt(weight) * np.abs(mean)] = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class _Seen:
    """What the data see: ``basis`` [p, r] makes the regressors orthonormal, ``response`` [r] in it, ``unseen`` rest."""

    basis: RealArray
    response: RealArray
    unseen: FloatArray
    rank: int
    condition: float


def _directions(regressors: RealArray, response: RealArray) -> _Seen:
    condition, size = condition_number(regressors), len(response)
    scaled, norms = equilibrate(regressors)
    u, values, vt = np.linalg.svd(scaled)
    rank = int(np.sum(values > IDENTIFIABILITY.collinear * max(float(values.max(initial=0.0)), 0.5)))
    if rank == size:
        return _Seen(triangular_inverse(regressors), response, np.zeros((size, 0)), size, condition)
    basis = (vt[:rank].T / values[:rank] / norms[:, None]).astype(np.longdouble)
    return _Seen(basis, u[:, :rank].T @ response, vt[rank:].T / norms[:, None], rank, LINEAR.unbounded)


def _least_prior(seen: _Seen, spans: FloatArray) -> tuple[FloatArray, RealArray]:
    """Root [p, p − r] of the prior N(0, 1/span²) along the unseen directions, and the basis freed of them."""
    q = np.linalg.qr(seen.unseen * spans[:, None])[0]
    null = q / spans[:, None]
    return null, seen.basis - null @ (q.T @ (seen.basis * spans[:, None]))


def _missed(regressors: RealArray, response: RealArray, seen: _Seen) -> float:
    """Norm of the response inside the triangle that the seen directions leave over: nothing at full rank."""
    if seen.rank == len(response):
        return 0.0
    left = response - regressors @ (seen.basis @ seen.response)
    return float(np.sqrt(left @ left))


def _inflation(regressors: RealArray, seen: _Seen) -> FloatArray:
    """Variance inflation [p]: variance of a slope over what it were with the other regressors away."""
    factors = np.sum(np.square(seen.basis), axis=1) * np.sum(np.square(regressors), axis=0)
    hidden = np.any(np.abs(seen.unseen) > IDENTIFIABILITY.hidden * np.abs(seen.unseen).max(initial=0.0), axis=1)
    return np.where(hidden, LINEAR.unbounded, np.maximum(factors.astype(float), 1.0))


def triangular_inverse(upper: RealArray) -> RealArray:
    """Inverse of an upper triangle by back substitution, in its own precision."""
    size = len(upper)
    inverse = np.zeros_like(upper)
    for i in reversed(range(size)):
        inverse[i, i] = 1.0 / upper[i, i]
        inverse[i, i + 1 :] = -(upper[i, i + 1 :] @ inverse[i + 1 :, i + 1 :]) * inverse[i, i]
    return inverse


def _with_intercept(root: RealArray, mean: RealArray, intercept: RealArray) -> RealArray:
    size, rank = root.shape
    whole = np.zeros((size + 1, rank + 1), dtype=root.dtype)
    whole[0, 0], whole[0, 1:], whole[1:, 1:] = intercept, -mean @ root, root
    return whole
