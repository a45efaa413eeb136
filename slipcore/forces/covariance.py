"""Root of the covariance of data, which are noise of variance 1 and what unknowns of variance 1 make of them."""

import numpy as np
from scipy.linalg import lapack

from slipcore.frames import FloatArray


def covariance_root(spread: FloatArray) -> FloatArray:
    """R [m, m], upper triangular, of 1 + S Sᵀ = Rᵀ R for a ``spread`` S [m, p].

    By QR of the unit matrix on top of Sᵀ (Golub and Van Loan, Matrix Computations, 4th ed., §6.5.3): the sum itself
    would have the square of R's condition number, and lose what is small beside its largest eigenvalue.
    """
    blocks = min(32, len(spread))  # columns at a time; of all sizes about as fast
    root, *_ = lapack.dtpqrt(0, blocks, np.eye(len(spread), order="F"), spread.T, overwrite_a=True)
    return np.asarray(root)
