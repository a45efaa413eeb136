"""Root of the covariance of data, which are noise of variance 1 and what unknowns of variance 1 make of them.

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
    m, p = spread.shape
    block = min(32, m)  # columns at a time; of all sizes about as fast
    root, below = np.eye(m, order="F"), np.array(spread.T, dtype=np.float64, order="F")
    reflectors, work = np.empty((block, m), order="F"), np.empty(block * m)
    sizes = [byref(c_int(size)) for size in (p, m, 0, block)]
    arrays = [(root, m), (below, max(p, 1)), (reflectors, block)]
    info = c_int()
    _dtpqrt(*sizes, *(each for array, rows in arrays for each in (array.ctypes.data, byref(c_int(rows)))),
            work.ctypes.data, byref(info))  # fmt: skip
    return root


def solve_root(root: FloatArray, data: FloatArray, *, transposed: bool = False) -> FloatArray:
    """R⁻¹ D of data D [m, n], or (Rᵀ)⁻¹ D."""
    return np.asarray(lapack.dtrtrs(root, data, trans=int(transposed))[0])
