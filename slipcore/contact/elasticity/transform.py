"""Circular convolutions of fields of cells with an influence, by Fourier transforms.

Along y first, of two real columns at once as one complex one; then along x, for as many waves along y at a time as
``lanes`` takes (eight, sixteen in single precision), with multiplication and the way back while the data are near at
hand. Padding is never stored for a whole field.
"""

from typing import Any

import numpy as np
import scipy.fft
from numpy.typing import NDArray

from slipcore.compilation import compiled
from slipcore.contact.elasticity.fourier import IntArray, forward, inverse, places, radices, twiddles
from slipcore.frames import FloatArray
from slipcore.lanes import BYTES, count, load, store, transpose


def fast_lengths(shape: tuple[int, int]) -> tuple[int, int]:
    """The next lengths that transform fast."""
    ny, nx = (int(scipy.fft.next_fast_len(size, real=True)) for size in shape)
    return ny, nx


def padded_lengths(shape: tuple[int, int]) -> tuple[int, int]:
    """Lengths from which a circular convolution of such fields does not wrap, and that transform fast."""
    ny, nx = shape
    return fast_lengths((2 * ny - 1, 2 * nx - 1))


Numbers = NDArray[Any]
"""Of double or single precision."""
Plan = tuple[IntArray, FloatArray, IntArray, IntArray, FloatArray]
"""``radices``, ``twiddles`` and ``places`` of the length along y; ``radices`` and ``twiddles`` of that along x."""
Work = tuple[Numbers, Numbers, Numbers, Numbers]
"""Columns along y, as many as lanes; all rows along x between the transforms; rows, as many as lanes, of up to two
fields before and after they are multiplied; four square tiles.
"""
Compiled = tuple[Numbers, tuple[float, bool], Plan, Work]
"""Symbols, their factor (a scale, and whether they are imaginary), plan and work space of a convolution."""


class Convolution:
    """Convolutions of one or two fields [k, ny, nx], padded with zeros to ``lengths``, that give one or two fields.

    Symbols are influences as their transforms are used: [blocks of waves along y, waves along x, lanes]. Not for
    several threads at once: work space is kept, as fresh memory would cost as much as the transforms.
    """

    __slots__ = ("_plan", "_work", "lengths", "shape")

    def __init__(self, shape: tuple[int, int], lengths: tuple[int, int]) -> None:
        self.shape, self.lengths = shape, lengths
        along_y, along_x = lengths
        # Plain tuples enter compiled code faster than named ones.
        self._plan: Plan = (
            radices(along_y),
            twiddles(along_y),
            places(along_y),
            radices(along_x),
            twiddles(along_x),
        )
        self._work: dict[tuple[int, str], Work] = {}

    def __call__(self, fields: FloatArray, symbols: FloatArray, turned: bool = False, sign: float = 1.0) -> FloatArray:
        """Fields [m, ny, nx] from [k, ny, nx] and symbols [m, k, ...]; ``turned``: symbols count as imaginary."""
        assert fields.shape[1:] == self.shape  # compiled code does not check
        fields, result = np.ascontiguousarray(fields), np.empty((len(symbols), *self.shape))
        convolve(fields, result, self.by(symbols, turned, sign))
        return result

    def by(self, symbols: Numbers, turned: bool = False, sign: float = 1.0) -> Compiled:
        """The same for compiled code: what ``convolve`` takes beside the fields and their result.

        All in the precision of the symbols; single takes 0.6 of the time.
        """
        key = max(symbols.shape[:2]), symbols.dtype.char
        if key not in self._work:
            self._work[key] = self._space(*key, symbols.shape[2], symbols.shape[4])
        scale = sign / (self.lengths[0] * self.lengths[1])
        return symbols, (scale, turned), self._plan, self._work[key]

    def _space(self, fields: int, precision: str, blocks: int, lanes: int) -> Work:
        (_, nx), (along_y, along_x), step = self.shape, self.lengths, 2 * lanes
        sizes = along_y * step, fields * blocks * nx * step, 4 * along_x * step, 4 * lanes**2
        column, between, rows, tiles = (np.zeros(size, dtype=precision) for size in sizes)
        return column, between, rows, tiles

    def spectrum(self, quadrant: FloatArray, odd_y: bool = False, odd_x: bool = False) -> FloatArray:
        """Spectrum of an influence given in its first quadrant: real, or its imaginary part if odd in one direction;
        for waves along y ≥ 0 and all waves along x.
        """
        (ny, nx), (padded_y, padded_x) = self.shape, self.lengths
        whole = np.zeros(self.lengths)
        whole[:ny, :nx] = quadrant
        whole[padded_y - ny + 1 :, :nx] = (-1.0 if odd_y else 1.0) * quadrant[:0:-1]
        mirrored = whole[:, nx - 1 : 0 : -1]
        whole[:, padded_x - nx + 1 :] = -mirrored if odd_x else mirrored
        spectrum = np.fft.rfft2(whole, axes=(1, 0))
        return spectrum.imag if odd_y != odd_x else spectrum.real


def symbols(spectra: list[list[FloatArray]]) -> FloatArray:
    """A matrix [m, k] of real spectra [waves along y ≥ 0, waves along x] as a convolution takes it."""
    turned = np.array([[spectrum[:, _order(spectrum.shape[1])] for spectrum in row] for row in spectra])
    return _in_blocks(turned, np.dtype(np.float64))


def single(symbols: FloatArray) -> Numbers:
    """The same symbols in single precision."""
    matrix, (blocks, along_x, lanes) = symbols.shape[:2], symbols.shape[2:]
    return _in_blocks(symbols.swapaxes(3, 4).reshape(*matrix, blocks * lanes, along_x), np.dtype(np.float32))


def _order(length: int) -> IntArray:
    """Frequencies in the order in which transforms leave them."""
    return np.argsort(places(length))


def _in_blocks(waves: FloatArray, precision: np.dtype[Any]) -> Numbers:
    """Waves along y [m, k, waves along y, waves along x] side by side, as many as lanes of a precision."""
    lanes = BYTES // precision.itemsize
    *matrix, along_y, along_x = waves.shape
    blocks = -(-along_y // lanes)
    filled = np.zeros((*matrix, blocks * lanes, along_x), dtype=precision)
    filled[:, :, :along_y] = waves
    return np.ascontiguousarray(filled.reshape(*matrix, blocks, lanes, along_x).swapaxes(3, 4))


@compiled
def convolve(fields: Numbers, result: Numbers, by: Compiled) -> None:
    """Fill ``result`` [m, ny, nx] from fields [k, ny, nx], both contiguous."""
    symbols, (scale, turned), (splits_y, waves_y, places_y, splits_x, waves_x), work = by
    column, between, rows, tiles = work
    pair, lanes = _halves(fields), count(column)
    for first in range(0, pair[0], lanes):
        _read(fields.reshape(-1), fields.shape, pair, first, column)
        forward(column, splits_y, waves_y)
        _separate(column, places_y, (fields.shape[2], first, *pair), between, tiles)
    nx, given, found, blocks, step = fields.shape[2], len(fields), len(symbols), symbols.shape[2], 2 * lanes
    size = rows.size // 4
    for block in range(blocks):
        for k in range(given):
            row, at = rows[k * size : (k + 1) * size], (k * blocks + block) * nx * step
            _copy((between, at, lanes), (row, 0, lanes), (2 * nx, lanes), 1.0)
            row[nx * step :] = 0.0
            forward(row, splits_x, waves_x)
        _multiply(rows, symbols.reshape(-1), (found, given, blocks, block), turned)
        for m in range(found):
            row, at = rows[(2 + m) * size : (3 + m) * size], (m * blocks + block) * nx * step
            inverse(row, splits_x, waves_x)
            _copy((row, 0, lanes), (between, at, lanes), (2 * nx, lanes), 1.0)
    pair = _halves(result)
    for first in range(0, pair[0], lanes):
        _join(between, places_y, (nx, first, *pair), column, tiles)
        inverse(column, splits_y, waves_y)
        _write(result.reshape(-1), result.shape, pair, first, column, scale)


@compiled(inline=True)
def _halves(fields: Numbers) -> tuple[int, int, int, int]:
    """Columns that are real parts, then imaginary ones; field and column of the first of the latter."""
    nx = fields.shape[2]
    half = (nx + 1) // 2
    return (nx, nx, 1, 0) if len(fields) == 2 else (half, nx - half, 0, half)


@compiled
def _read(
    flat: Numbers, shape: tuple[int, int, int], pair: tuple[int, int, int, int], first: int, column: Numbers
) -> None:
    """As many pairs of columns as lanes from the ``first`` on, padded with zeros."""
    ny, nx, (reals, others, field, start), lanes = shape[1], shape[2], pair, count(column)
    column[:] = 0.0
    _copy((flat, first, nx), (column, 0, 2 * lanes), (ny, reals - first), 1.0)
    _copy((flat, field * ny * nx + start + first, nx), (column, lanes, 2 * lanes), (ny, others - first), 1.0)


@compiled
def _write(
    flat: Numbers,
    shape: tuple[int, int, int],
    pair: tuple[int, int, int, int],
    first: int,
    column: Numbers,
    scale: float,
) -> None:
    """The reverse of ``_read``, scaled."""
    ny, nx, (reals, others, field, start), lanes = shape[1], shape[2], pair, count(column)
    _copy((column, 0, 2 * lanes), (flat, first, nx), (ny, reals - first), scale)
    _copy((column, lanes, 2 * lanes), (flat, field * ny * nx + start + first, nx), (ny, others - first), scale)


@compiled
def _copy(
    source: tuple[Numbers, int, int], target: tuple[Numbers, int, int], size: tuple[int, int], scale: float
) -> None:
    """Rows of at most as many numbers as lanes, scaled; ``source`` and ``target``: a flat array, the first place and
    the step from row to row; ``size``: rows, and numbers that are left in them.
    """
    (given, at, step), (found, to, stride), (rows, left) = source, target, size
    if left >= count(given):
        for row in range(rows):
            store(found, to + row * stride, load(given, at + row * step) * scale)
    else:
        for row in range(rows):
            for i in range(left):
                found[to + row * stride + i] = given[at + row * step + i] * scale


@compiled
def _separate(
    column: Numbers,
    places_y: IntArray,
    where: tuple[int, int, int, int, int, int],
    between: Numbers,
    tiles: Numbers,
) -> None:
    """From spectra of pairs of columns, as many as lanes, those of each, for waves ≥ 0, as rows ``between``; ``where``:
    nx, the first column, and what ``_halves`` gives.
    """
    nx, first, reals, others, field, start = where
    length, lanes = places_y.size, count(column)
    last, blocks, step, square = length // 2, length // 2 // lanes + 1, 2 * lanes, lanes * lanes
    for block in range(blocks):
        for j in range(lanes):
            wave = min(block * lanes + j, last)
            at, opposite = places_y[wave] * step, places_y[(length - wave) % length] * step
            zr, zi = load(column, at) * 0.5, load(column, at + lanes) * 0.5
            cr, ci = load(column, opposite) * 0.5, load(column, opposite + lanes) * 0.5
            store(tiles, j * lanes, zr + cr)
            store(tiles, square + j * lanes, zi - ci)
            store(tiles, 2 * square + j * lanes, zi + ci)
            store(tiles, 3 * square + j * lanes, cr - zr)
        for tile in range(4):
            transpose(tiles, tile * square)
        row, other = block * nx + first, (field * blocks + block) * nx + start + first
        for i in range(lanes):
            if i < reals - first:
                store(between, (row + i) * step, load(tiles, i * lanes))
                store(between, (row + i) * step + lanes, load(tiles, square + i * lanes))
            if i < others - first:
                store(between, (other + i) * step, load(tiles, 2 * square + i * lanes))
                store(between, (other + i) * step + lanes, load(tiles, 3 * square + i * lanes))


@compiled
def _join(
    between: Numbers,
    places_y: IntArray,
    where: tuple[int, int, int, int, int, int],
    column: Numbers,
    tiles: Numbers,
) -> None:
    """The reverse: spectra of pairs of columns."""
    nx, first, _, _, field, start = where
    length, lanes = places_y.size, count(column)
    last, blocks, step, square = length // 2, length // 2 // lanes + 1, 2 * lanes, lanes * lanes
    for block in range(blocks):
        for i in range(lanes):
            row = (block * nx + min(first + i, nx - 1)) * step
            other = ((field * blocks + block) * nx + min(start + first + i, nx - 1)) * step
            store(tiles, i * lanes, load(between, row))
            store(tiles, square + i * lanes, load(between, row + lanes))
            store(tiles, 2 * square + i * lanes, load(between, other))
            store(tiles, 3 * square + i * lanes, load(between, other + lanes))
        for tile in range(4):
            transpose(tiles, tile * square)
        for j in range(min(lanes, last + 1 - block * lanes)):
            wave = block * lanes + j
            at, opposite = places_y[wave] * step, places_y[(length - wave) % length] * step
            ar, ai = load(tiles, j * lanes), load(tiles, square + j * lanes)
            br, bi = load(tiles, 2 * square + j * lanes), load(tiles, 3 * square + j * lanes)
            store(column, opposite, ar + bi)
            store(column, opposite + lanes, br - ai)
            store(column, at, ar - bi)
            store(column, at + lanes, br + ai)


@compiled
def _multiply(rows: Numbers, symbols: Numbers, sizes: tuple[int, int, int, int], turned: bool) -> None:
    """The spectra found, after those given, of one block of waves; ``sizes``: how many are found and given, and the
    block of how many.
    """
    found, given, blocks, block = sizes
    size, lanes = rows.size // 4, count(rows)
    for m in range(found):
        one = (m * given * blocks + block) * (size // 2)
        two = ((m * given + given - 1) * blocks + block) * (size // 2)
        for at in range(0, size, 2 * lanes):
            factor = load(symbols, one + at // 2)
            real, imaginary = factor * load(rows, at), factor * load(rows, at + lanes)
            if given == 2:
                factor = load(symbols, two + at // 2)
                real = real + factor * load(rows, size + at)
                imaginary = imaginary + factor * load(rows, size + at + lanes)
            to = (2 + m) * size + at
            store(rows, to, imaginary * -1.0 if turned else real)
            store(rows, to + lanes, real if turned else imaginary)
