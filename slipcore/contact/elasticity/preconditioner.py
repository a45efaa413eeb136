"""Cheap approximate inverses of the compliance: T. Chan's optimal circulant on a box hardly larger than the contact's.

Chan (1988): of all circulants the nearest, in the Frobenius norm, to a Toeplitz matrix; positive definite where that
is, and so is its part on a smaller box. It costs a quarter of an application of the operator, and makes conjugate
gradients independent of the grid. The box is padded to ``fast_lengths``: a prime one would take four times as long.
"""

import numpy as np

from slipcore.contact.elasticity.transform import Transform, multiply_pair
from slipcore.frames import FloatArray


def circulant_symbol(quadrant: FloatArray, odd: bool = False) -> FloatArray:
    """Spectrum [ny, nx // 2 + 1] of the nearest circulant to an influence given in its first quadrant.

    ``odd``: the influence is odd in both directions, not even.
    """
    sign = -1.0 if odd else 1.0
    wrapped = _average(_average(quadrant, sign).T, sign).T
    return np.ascontiguousarray(np.fft.rfft2(wrapped).real)


def _average(influence: FloatArray, sign: float) -> FloatArray:
    size = len(influence)
    share = (np.arange(size) / size)[:, None]
    mirrored = np.concatenate((np.zeros_like(influence[:1]), influence[:0:-1]))
    return (1.0 - share) * influence + sign * share * mirrored


class NormalInverse:
    """Approximate pressure [ny, nx] that makes a normal displacement; the influence ``nn`` is of a larger box."""

    __slots__ = ("_inverse", "_transform")

    def __init__(self, shape: tuple[int, int], nn: FloatArray) -> None:
        self._transform = Transform(shape, nn.shape)
        self._inverse = 1.0 / circulant_symbol(nn)

    def __call__(self, displacement: FloatArray) -> FloatArray:
        """Stress for a displacement of the same shape."""
        spectrum = self._transform.forward(displacement[None])
        spectrum *= self._inverse
        stress: FloatArray = self._transform.backward(spectrum)[0]
        return stress


class TangentialInverse:
    """Approximate traction [2, ny, nx] that makes a tangential displacement [2, ny, nx]; influences as above."""

    __slots__ = ("_inverse", "_transform")

    def __init__(self, shape: tuple[int, int], xx: FloatArray, yy: FloatArray, xy: FloatArray | None) -> None:
        self._transform = Transform(shape, xx.shape)
        a, d = circulant_symbol(xx), circulant_symbol(yy)
        self._inverse: tuple[FloatArray, FloatArray, FloatArray | None] = (1.0 / a, 1.0 / d, None)
        if xy is not None:
            b = circulant_symbol(xy, odd=True)
            determinant = a * d - b * b
            self._inverse = (d / determinant, a / determinant, -b / determinant)

    def __call__(self, displacement: FloatArray) -> FloatArray:
        """Stress for a displacement of the same shape."""
        spectrum = self._transform.forward(displacement)
        multiply_pair(spectrum, *self._inverse)
        return self._transform.backward(spectrum)
