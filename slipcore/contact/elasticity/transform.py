"""Real FFT of fields of cells, in work space that is kept: fresh memory would cost as much as the transform."""

import numpy as np
import scipy.fft
from numpy.typing import NDArray

from slipcore.compilation import compiled
from slipcore.frames import FloatArray

ComplexArray = NDArray[np.complex128]


def fast_lengths(shape: tuple[int, int]) -> tuple[int, int]:
    """The next lengths that transform fast."""
    ny, nx = (int(scipy.fft.next_fast_len(size, real=True)) for size in shape)
    return ny, nx


def padded_lengths(shape: tuple[int, int]) -> tuple[int, int]:
    """Lengths from which a circular convolution of such fields does not wrap, and that transform fast."""
    ny, nx = shape
    return fast_lengths((2 * ny - 1, 2 * nx - 1))


class Transform:
    """Real FFT of fields [k, ny, nx], padded with zeros to ``lengths``.

    Rows that hold only padding are skipped on the way in and on the way out, a quarter of the work of a padded
    transform. Not for several threads at once: the spectrum of ``forward`` is valid until its next call for as many
    fields.
    """

    __slots__ = ("_real", "_spectrum", "lengths", "shape")

    def __init__(self, shape: tuple[int, int], lengths: tuple[int, int]) -> None:
        self.shape, self.lengths = shape, lengths
        self._spectrum: dict[int, ComplexArray] = {}
        self._real: dict[int, FloatArray] = {}

    def forward(self, field: FloatArray) -> ComplexArray:
        """Spectrum [k, Ny, Nx // 2 + 1] of fields [k, ny, nx]."""
        (ny, _), (padded_y, padded_x) = self.shape, self.lengths
        count = len(field)
        if count not in self._spectrum:
            self._spectrum[count] = np.empty((count, padded_y, padded_x // 2 + 1), dtype=np.complex128)
        spectrum = self._spectrum[count]
        np.fft.rfft(field, padded_x, axis=-1, out=spectrum[:, :ny])
        spectrum[:, ny:] = 0.0
        return np.fft.fft(spectrum, axis=-2, out=spectrum)

    def backward(self, spectrum: ComplexArray) -> FloatArray:
        """The fields of a spectrum, which is overwritten."""
        (ny, nx), count = self.shape, len(spectrum)
        if count not in self._real:
            self._real[count] = np.empty((count, ny, self.lengths[1]))
        np.fft.ifft(spectrum, axis=-2, out=spectrum)
        rows = np.fft.irfft(spectrum[:, :ny], self.lengths[1], axis=-1, out=self._real[count])
        return rows[..., :nx].copy()

    def symbol(self, quadrant: FloatArray, odd_y: bool = False, odd_x: bool = False) -> FloatArray:
        """Spectrum of an influence given in its first quadrant: real, or its imaginary part if odd in one direction."""
        (ny, nx), (padded_y, padded_x) = self.shape, self.lengths
        whole = np.zeros(self.lengths)
        whole[:ny, :nx] = quadrant
        whole[padded_y - ny + 1 :, :nx] = (-1.0 if odd_y else 1.0) * quadrant[:0:-1]
        mirrored = whole[:, nx - 1 : 0 : -1]
        whole[:, padded_x - nx + 1 :] = -mirrored if odd_x else mirrored
        spectrum = np.fft.rfft2(whole)
        return np.ascontiguousarray(spectrum.imag if odd_y != odd_x else spectrum.real)


def multiply_pair(spectrum: ComplexArray, xx: FloatArray, yy: FloatArray, xy: FloatArray | None) -> None:
    """Multiply the spectra [2, ...] of a vector field by a symmetric real matrix, in place."""
    if xy is None:
        spectrum[0] *= xx
        spectrum[1] *= yy
    else:
        _multiply(spectrum[0].ravel(), spectrum[1].ravel(), xx.ravel(), yy.ravel(), xy.ravel())


@compiled
def _multiply(along_x: ComplexArray, along_y: ComplexArray, xx: FloatArray, yy: FloatArray, xy: FloatArray) -> None:
    for i in range(xx.size):
        first, second = along_x[i], along_y[i]
        along_x[i] = xx[i] * first + xy[i] * second
        along_y[i] = xy[i] * first + yy[i] * second
