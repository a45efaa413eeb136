"""Cheap approximate inverses of the compliance: T. Chan's optimal circulant on the unpadded box.

Chan (1988): of all circulants the nearest, in the Frobenius norm, to a Toeplitz matrix; positive definite where that
is. It costs a quarter of an application of the operator, and makes conjugate gradients independent of the grid.
"""

import numpy as np
import scipy.fft

from slipcore.frames import FloatArray


def circulant_symbol(quadrant: FloatArray, odd: bool = False) -> FloatArray:
    """Spectrum [ny, nx // 2 + 1] of the nearest circulant to a kernel given in its first quadrant.

    ``odd``: the kernel is odd in both directions, not even.
    """
    sign = -1.0 if odd else 1.0
    wrapped = _average(_average(quadrant, sign).T, sign).T
    return np.ascontiguousarray(scipy.fft.rfft2(wrapped).real)


def _average(kernel: FloatArray, sign: float) -> FloatArray:
    size = len(kernel)
    share = (np.arange(size) / size)[:, None]
    mirrored = np.concatenate((np.zeros_like(kernel[:1]), kernel[:0:-1]))
    return (1.0 - share) * kernel + sign * share * mirrored


class NormalInverse:
    """Approximate pressure [ny, nx] that makes a normal displacement."""

    __slots__ = ("_inverse", "_shape")

    def __init__(self, nn: FloatArray) -> None:
        self._shape = nn.shape
        self._inverse = 1.0 / circulant_symbol(nn)

    def __call__(self, displacement: FloatArray) -> FloatArray:
        """Stress for a displacement of the same shape."""
        spectrum = scipy.fft.rfft2(displacement)
        spectrum *= self._inverse
        return scipy.fft.irfft2(spectrum, s=self._shape, overwrite_x=True)


class TangentialInverse:
    """Approximate traction [2, ny, nx] that makes a tangential displacement [2, ny, nx]."""

    __slots__ = ("_inverse", "_shape")

    def __init__(self, xx: FloatArray, yy: FloatArray, xy: FloatArray | None) -> None:
        self._shape = xx.shape
        a, d = circulant_symbol(xx), circulant_symbol(yy)
        self._inverse: tuple[FloatArray, FloatArray, FloatArray | None]
        if xy is None:
            self._inverse = (1.0 / a, 1.0 / d, None)
        else:
            b = circulant_symbol(xy, odd=True)
            determinant = a * d - b * b
            self._inverse = (d / determinant, a / determinant, -b / determinant)

    def __call__(self, displacement: FloatArray) -> FloatArray:
        """Stress for a displacement of the same shape."""
        spectrum = scipy.fft.rfft2(displacement)
        along_x, along_y, cross = self._inverse
        result = np.empty_like(spectrum)
        np.multiply(along_x, spectrum[0], out=result[0])
        np.multiply(along_y, spectrum[1], out=result[1])
        if cross is not None:
            result[0] += cross * spectrum[1]
            result[1] += cross * spectrum[0]
        return scipy.fft.irfft2(result, s=self._shape, overwrite_x=True)
