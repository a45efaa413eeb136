"""Cheap approximate inverses of the compliance: T. Chan's optimal circulant on a box hardly larger than the contact's.

Chan (1988): of all circulants the nearest, in the Frobenius norm, to a Toeplitz matrix; positive definite where that
is, and so is its part on a smaller box. It costs a quarter of an application of the operator, and makes conjugate
gradients independent of the grid. The box is padded to ``fast_lengths``: a prime one would take four times as long.
"""

import numpy as np

from slipcore.contact.elasticity.transform import Compiled, Convolution, single, symbols
from slipcore.frames import FloatArray


def circulant_spectrum(quadrant: FloatArray, odd: bool = False) -> FloatArray:
    """Spectrum [ny // 2 + 1, nx] of the nearest circulant to an influence given in its first quadrant.

    ``odd``: the influence is odd in both directions, not even.
    """
    sign = -1.0 if odd else 1.0
    wrapped = _average(_average(quadrant, sign).T, sign).T
    return np.ascontiguousarray(np.fft.rfft2(wrapped, axes=(1, 0)).real)


def _average(influence: FloatArray, sign: float) -> FloatArray:
    size = len(influence)
    share = (np.arange(size) / size)[:, None]
    mirrored = np.concatenate((np.zeros_like(influence[:1]), influence[:0:-1]))
    return (1.0 - share) * influence + sign * share * mirrored


class NormalInverse:
    """Approximate pressure [ny, nx] that makes a normal displacement; the influence ``nn`` is of a larger box."""

    __slots__ = ("_convolution", "_inverse")

    def __init__(self, shape: tuple[int, int], nn: FloatArray) -> None:
        self._convolution = Convolution(shape, nn.shape)
        self._inverse = symbols([[1.0 / circulant_spectrum(nn)]])

    def __call__(self, displacement: FloatArray) -> FloatArray:
        """Stress for a displacement of the same shape."""
        stress: FloatArray = self._convolution(displacement[None], self._inverse)[0]
        return stress

    @property
    def compiled(self) -> Compiled:
        """The same for compiled code."""
        return self._convolution.by(self._inverse)


class TangentialInverse:
    """Approximate traction [2, ny, nx] that makes a tangential displacement [2, ny, nx]; influences as above.

    ``single``: the same for compiled code in single precision, of displacements in units of ``xx`` of a cell on itself.
    """

    __slots__ = ("_convolution", "_inverse", "single")

    def __init__(self, shape: tuple[int, int], xx: FloatArray, yy: FloatArray, xy: FloatArray | None) -> None:
        self._convolution = Convolution(shape, xx.shape)
        a, d = circulant_spectrum(xx), circulant_spectrum(yy)
        b = np.zeros_like(a) if xy is None else circulant_spectrum(xy, odd=True)
        determinant = a * d - b * b
        self._inverse = symbols([[d / determinant, -b / determinant], [-b / determinant, a / determinant]])
        self.single: Compiled = self._convolution.by(single(self._inverse * xx[0, 0]))

    def __call__(self, displacement: FloatArray) -> FloatArray:
        """Stress for a displacement of the same shape."""
        return self._convolution(displacement, self._inverse)
