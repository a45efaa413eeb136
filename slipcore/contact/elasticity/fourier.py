"""Fourier transforms of as many complex sequences at a time as ``lanes`` takes, in place, in compiled code.

``data`` [n · 2 · count]: for each place of the sequences ``count(data)`` real parts, then as many imaginary ones.
Stages split lengths by 4, 2, 3 and 5 (Gentleman and Sande 1966). The order in which frequencies come out is that of
``places``: a convolution need not sort them, because ``inverse`` takes them as ``forward`` leaves them.

The inverse is the forward stages backward, on sequences with real and imaginary parts exchanged: i times the conjugate.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from slipcore.compilation import compiled
from slipcore.frames import FloatArray
from slipcore.lanes import count, load, store

IntArray = NDArray[np.int64]

_COS_3, _SIN_3 = -0.5, float(np.sqrt(0.75))
_COS_5, _SIN_5 = float(np.cos(0.4 * np.pi)), float(np.sin(0.4 * np.pi))
_COS_5_2, _SIN_5_2 = float(np.cos(0.8 * np.pi)), float(np.sin(0.8 * np.pi))


def radices(length: int) -> IntArray:
    """Factors of a length that has no others than 2, 3 and 5; by how many parts each stage splits."""
    found = []
    for radix in (4, 2, 3, 5):
        while length % radix == 0:
            found.append(radix)
            length //= radix
    assert length == 1
    return np.array(found, dtype=np.int64)


def twiddles(length: int) -> FloatArray:
    """Real and imaginary parts [2 · length] of exp(−2πi k/length)."""
    waves = np.exp(-2j * np.pi * np.arange(length) / length)
    return np.ascontiguousarray(np.stack((waves.real, waves.imag), axis=-1).ravel())


def places(length: int) -> IntArray:
    """Where ``forward`` leaves each frequency [length]."""
    place, frequency, left = np.zeros(length, dtype=np.int64), np.arange(length), length
    for radix in radices(length):
        left //= int(radix)
        place += (frequency % radix) * left
        frequency = frequency // radix
    return place


@compiled
def forward(data: FloatArray, splits: IntArray, waves: FloatArray) -> None:
    """Transform in place; ``splits`` and ``waves``: ``radices`` and ``twiddles`` of the length."""
    size = data.size // (2 * count(data))
    for radix in splits:
        _stage(data, size, radix, waves, False)
        size //= radix


@compiled
def inverse(data: FloatArray, splits: IntArray, waves: FloatArray) -> None:
    """Transform back in place, without division by the length."""
    size = 1
    for radix in splits[::-1]:
        size *= radix
        _stage(data, size, radix, waves, True)


@compiled
def _stage(data: FloatArray, size: int, radix: int, waves: FloatArray, back: bool) -> None:
    """One stage for all parts of ``size`` places."""
    step = 2 * count(data)
    jump = 2 * (data.size // (step * size))
    for first in range(0, data.size, size * step):
        for k in range(size // radix):
            at, between = first + k * step, size // radix * step
            if radix == 4:
                _four(data, at, between, waves, k * jump, back)
            elif radix == 2:
                _two(data, at, between, waves, k * jump, back)
            elif radix == 3:
                _three(data, at, between, waves, k * jump, back)
            else:
                _five(data, at, between, waves, k * jump, back)


@compiled(inline=True)
def _get(data: FloatArray, at: int, waves: FloatArray, wave: int, back: bool) -> tuple[Any, Any]:
    """The values of one place; on the way back exchanged, and turned by a wave."""
    if not back:
        return load(data, at), load(data, at + count(data))
    return _turned(load(data, at + count(data)), load(data, at), waves, wave)


@compiled(inline=True)
def _put(data: FloatArray, at: int, value: tuple[Any, Any], waves: FloatArray, wave: int, back: bool) -> None:
    """The reverse: turned by a wave on the way there."""
    if back:
        store(data, at + count(data), value[0])
        store(data, at, value[1])
    else:
        real, imaginary = _turned(value[0], value[1], waves, wave)
        store(data, at, real)
        store(data, at + count(data), imaginary)


@compiled(inline=True)
def _turned(real: Any, imaginary: Any, waves: FloatArray, wave: int) -> tuple[Any, Any]:
    cosine, sine = waves[wave], waves[wave + 1]
    return real * cosine - imaginary * sine, real * sine + imaginary * cosine


@compiled(inline=True)
def _two(data: FloatArray, at: int, between: int, waves: FloatArray, wave: int, back: bool) -> None:
    ar, ai = _get(data, at, waves, 0, back)
    br, bi = _get(data, at + between, waves, wave, back)
    _put(data, at, (ar + br, ai + bi), waves, 0, back)
    _put(data, at + between, (ar - br, ai - bi), waves, wave, back)


@compiled(inline=True)
def _three(data: FloatArray, at: int, between: int, waves: FloatArray, wave: int, back: bool) -> None:
    ar, ai = _get(data, at, waves, 0, back)
    br, bi = _get(data, at + between, waves, wave, back)
    cr, ci = _get(data, at + 2 * between, waves, 2 * wave, back)
    sr, si, dr, di = br + cr, bi + ci, (br - cr) * _SIN_3, (bi - ci) * _SIN_3
    mr, mi = ar + sr * _COS_3, ai + si * _COS_3
    _put(data, at, (ar + sr, ai + si), waves, 0, back)
    _put(data, at + between, (mr + di, mi - dr), waves, wave, back)
    _put(data, at + 2 * between, (mr - di, mi + dr), waves, 2 * wave, back)


@compiled(inline=True)
def _four(data: FloatArray, at: int, between: int, waves: FloatArray, wave: int, back: bool) -> None:
    ar, ai = _get(data, at, waves, 0, back)
    br, bi = _get(data, at + between, waves, wave, back)
    cr, ci = _get(data, at + 2 * between, waves, 2 * wave, back)
    dr, di = _get(data, at + 3 * between, waves, 3 * wave, back)
    sr, si, tr, ti = ar + cr, ai + ci, ar - cr, ai - ci
    ur, ui, vr, vi = br + dr, bi + di, br - dr, bi - di
    _put(data, at, (sr + ur, si + ui), waves, 0, back)
    _put(data, at + between, (tr + vi, ti - vr), waves, wave, back)
    _put(data, at + 2 * between, (sr - ur, si - ui), waves, 2 * wave, back)
    _put(data, at + 3 * between, (tr - vi, ti + vr), waves, 3 * wave, back)


@compiled(inline=True)
def _five(data: FloatArray, at: int, between: int, waves: FloatArray, wave: int, back: bool) -> None:
    ar, ai = _get(data, at, waves, 0, back)
    br, bi = _get(data, at + between, waves, wave, back)
    cr, ci = _get(data, at + 2 * between, waves, 2 * wave, back)
    dr, di = _get(data, at + 3 * between, waves, 3 * wave, back)
    er, ei = _get(data, at + 4 * between, waves, 4 * wave, back)
    sr, si, tr, ti = br + er, bi + ei, cr + dr, ci + di
    ur, ui, vr, vi = br - er, bi - ei, cr - dr, ci - di
    mr, mi = ar + sr * _COS_5 + tr * _COS_5_2, ai + si * _COS_5 + ti * _COS_5_2
    nr, ni = ar + sr * _COS_5_2 + tr * _COS_5, ai + si * _COS_5_2 + ti * _COS_5
    pr, pi = ur * _SIN_5 + vr * _SIN_5_2, ui * _SIN_5 + vi * _SIN_5_2
    qr, qi = ur * _SIN_5_2 - vr * _SIN_5, ui * _SIN_5_2 - vi * _SIN_5
    _put(data, at, (ar + sr + tr, ai + si + ti), waves, 0, back)
    _put(data, at + between, (mr + pi, mi - pr), waves, wave, back)
    _put(data, at + 2 * between, (nr + qi, ni - qr), waves, 2 * wave, back)
    _put(data, at + 3 * between, (nr - qi, ni + qr), waves, 3 * wave, back)
    _put(data, at + 4 * between, (mr - pi, mi + pr), waves, 4 * wave, back)
