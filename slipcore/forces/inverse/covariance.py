"""Roots of covariances where data are noise of variance 1 and what unknowns of variance 1 make of them.

By routines that leave other threads the interpreter: a live stream's frames go on while its contact is sought.
"""

from ctypes import CFUNCTYPE, byref, c_int, c_void_p

import numpy as np
from scipy.linalg import lapack

from slipcore.compilation import lapack_address
from slipcore.frames import FloatArray

_dtpqrt = CFUNCTYPE(None, *[c_void_p] * 12)(lapack_address("dtpqrt"))
"""``scipy.linalg.lapack.dtpqrt`` itself keeps the interpreter."""


def covariance_root(spread: FloatArray) -> FloatArray:
    """R [m, m], upper triangular, of 1 + S Sᵀ = Rᵀ R for a ``spread`` S [m, p].

    By QR of the unit matrix on top of Sᵀ (Golub and Van Loan, Matrix Computations, 4th ed., §6.5.3): the sum itself
    would have the square of R's condition number, and lose what is small beside its largest eigenvalue.
    """
    return _eliminated(spread.T)[0]


def triangles_root(upper: FloatArray) -> FloatArray:
    """R [r, r], upper triangular, of 1 + UᵀU = Rᵀ R for U [r, r] that is upper triangular: of a quarter of the cost."""
    return _eliminated(upper, triangular=True)[0]


def posterior(response: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Of unknowns [p] by data [m] that a ``response`` A [m, p] makes of them: a root [p, p], upper triangular, of their
    covariance (1 + AᵀA)⁻¹, and the operator (1 + AᵀA)⁻¹ Aᵀ [p, m] from data to their mean.

    By QR of the unit matrix on top of A: the root is R⁻¹ = Q_1, and the operator Q_1 Q_2ᵀ. Reflectors that begin with
    the unit matrix, as [1; V], have the product 1 - [1; V] T [1; V]ᵀ, where T⁻¹ is the upper triangle of 1 + VᵀV with
    half of its diagonal (Joffrain et al., Accumulating Householder transformations, revisited, ACM TOMS 32, 2006):
    Q is as orthogonal as if they were applied, at half of the cost.
    """
    _, below = _eliminated(response)
    unit = np.eye(below.shape[1])
    inner = below.T @ below + unit
    np.fill_diagonal(inner, 0.5 * np.diag(inner))
    factor = np.triu(lapack.dtrtri(inner)[0])
    root = unit - factor
    return root, -root @ (below @ factor).T


def posterior_operator(response: FloatArray) -> FloatArray:
    """The operator of ``posterior`` alone, where data are fewer than unknowns from their covariance RᵀR = 1 + A Aᵀ:
    (R⁻ᵀ A)ᵀ R⁻ᵀ, of which no factor is larger than 1.
    """
    m, p = response.shape
    if m >= p:
        return posterior(response)[1]
    seen = solve_root(covariance_root(response), np.column_stack((response, np.eye(m))), transposed=True)
    return np.asarray(seen[:, :p].T @ seen[:, p:])


def solve_root(root: FloatArray, data: FloatArray, *, transposed: bool = False) -> FloatArray:
    """R⁻¹ D of data D [m, n], or (Rᵀ)⁻¹ D."""
    return np.asarray(lapack.dtrtrs(root, data, trans=int(transposed))[0])


def _eliminated(matrix: FloatArray, triangular: bool = False) -> tuple[FloatArray, FloatArray]:
    """R [p, p] by QR of the unit matrix on top of a ``matrix`` [m, p], and V [m, p] of the reflectors [1; V]; of one
    that is upper ``triangular`` zeros are kept.
    """
    m, p = matrix.shape
    block = min(32, p)  # columns at a time; of all sizes about as fast
    root, below = np.eye(p, order="F"), np.array(matrix, dtype=np.float64, order="F")
    reflectors, work = np.empty((block, p), order="F"), np.empty(block * p)
    sizes = [byref(c_int(size)) for size in (m, p, m if triangular else 0, block)]
    arrays = [(root, p), (below, max(m, 1)), (reflectors, block)]
    info = c_int()
    _dtpqrt(*sizes, *(each for array, rows in arrays for each in (array.ctypes.data, byref(c_int(rows)))),
            work.ctypes.data, byref(info))  # fmt: skip
    return root, below
