"""Singular values, and what data have along their directions: all that evidence takes, at half of the cost of
``numpy.linalg.svd``.

By routines that leave other threads the interpreter: a live stream's frames go on while its contact is sought.
"""

from ctypes import CFUNCTYPE, byref, c_char, c_int, c_void_p

import numpy as np
import scipy.linalg

from slipcore.compilation import lapack_address
from slipcore.frames import FloatArray

_dgebrd = CFUNCTYPE(None, *[c_void_p] * 11)(lapack_address("dgebrd"))
_dormbr = CFUNCTYPE(None, *[c_void_p] * 14)(lapack_address("dormbr"))
_dbdsqr = CFUNCTYPE(None, *[c_void_p] * 15)(lapack_address("dbdsqr"))


def singular_components(matrix: FloatArray, data: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Singular values s [r] of a ``matrix`` [m, p] = U s Vᵀ, largest first, and Uᵀd [r] of ``data`` d [m], up to signs.

    The matrix is made bidiagonal, and the rotations that make this one diagonal turn the data alone (Golub and Van
    Loan, Matrix Computations, 4th ed., §8.6): no singular vectors are formed. A matrix much wider than high is made
    square first, by QR of its transpose, which turns no data (Chan, ACM Trans. Math. Softw. 8 (1982) 72).
    """
    if 3 * matrix.shape[1] > 5 * matrix.shape[0]:  # both steps then take fewer operations than one
        upper = scipy.linalg.qr(matrix.T, mode="r", check_finite=False)[0]
        matrix = np.asarray(upper[: len(matrix)].T, dtype=np.float64)
    left = np.array(matrix, dtype=np.float64, order="F")
    turned = np.array(data, dtype=np.float64)
    m, p = left.shape
    r = min(m, p)
    values, beside, of_left, of_right = (np.zeros(max(r, 1)) for _ in range(4))
    block = 64  # columns that LAPACK takes at a time, at most
    work, info = np.empty(max(block * (m + p), 4 * r)), c_int()
    rows, columns, count, one, none, length = (byref(c_int(size)) for size in (m, p, r, 1, 0, len(work)))
    a, d, e, c, space = (array.ctypes.data for array in (left, values, beside, turned, work))
    tau, done = of_left.ctypes.data, byref(info)
    _dgebrd(rows, columns, a, rows, d, e, tau, of_right.ctypes.data, space, length, done)
    q, from_left, transposed = (byref(c_char(letter)) for letter in (b"Q", b"L", b"T"))
    _dormbr(q, from_left, transposed, rows, one, columns, a, rows, tau, c, rows, space, length, done)
    above = byref(c_char(b"U" if m >= p else b"L"))
    _dbdsqr(above, count, none, none, one, d, e, space, one, space, one, c, rows, space, done)
    if info.value > 0:
        raise np.linalg.LinAlgError("singular values did not converge")
    return values[:r], turned[:r]
