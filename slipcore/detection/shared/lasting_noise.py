"""Noise that three frames do not show: what of it lasts from frame to frame, and steps in which places are given."""

import math

import numpy as np

from slipcore.compilation import compiled
from slipcore.defaults import NOISE
from slipcore.frames import FloatArray
from slipcore.noise import ranked, recent_median, remember

SERIES = NOISE.series
_MEMORY, _LEAST, _LEVELS, _INNER = NOISE.memory, NOISE.least_step, NOISE.step_levels, NOISE.least_inner
_FINEST, _BEND = NOISE.finest_step, NOISE.field_bend
SPREAD, STEP, TURNING = 9, 10, 11
"""Rows of a memory's noise, behind those of ``observe.step_noise``: a ring of estimates, the step, m, and what tells
whether forces turn with the surface (``surface.turning``): sums, and whether they do.
"""
ROWS = 12
OF_STENCIL = 6.0
"""Standard deviation of ``bend`` for white noise of 1: √Σ of its squared weights 1, −2, 1 over 1, −2, 1."""
OF_QUARTILE = 0.31864
"""Lower quartile of the magnitude of a standard normal variable, Φ⁻¹(⅝)."""
OF_STEP = 1.0 / math.sqrt(12.0)
"""Standard deviation of rounding over its step: the variance of a uniform variable."""


def start_noise() -> FloatArray:
    """What is remembered of noise before the first frame."""
    return np.zeros((ROWS, max(1 + NOISE.memory, SERIES)))


@compiled
def step_lasting(
    noise: FloatArray, displacement: FloatArray, fresh: bool, after: FloatArray, series: FloatArray
) -> tuple[float, float, float]:
    """Learn from one more frame, unless it is not ``fresh``: standard deviation of a marker coordinate by how it parts
    from its neighbours', m, NaN while unknown, and the steps in which places are given, in the plane and in depth, m, 0
    if there is none. ``series`` [2, k]: room.
    """
    after[SPREAD:TURNING] = noise[SPREAD:TURNING]
    if fresh:
        remember(after[SPREAD], noise_between_neighbours(displacement, series.ravel()))
        seek_steps(displacement, after[STEP], series)
    return recent_median(after[SPREAD], series[0]), step_in_plane(after[STEP]), after[STEP, 2]


@compiled
def noise_between_neighbours(displacement: FloatArray, values: FloatArray) -> float:
    """Standard deviation of a coordinate in the plane by how displacement [n, m, 3] bends both along and across,
    in m: the lower quartile over evenly chosen elements, most of which lie where the field is even, without what a
    field of that size may bend by itself. NaN where there are
    fewer than ``NOISE.least_inner`` that have neighbours. ``values``: room for twice as many.
    """
    n, m, _ = displacement.shape
    inner = max(n - 2, 0) * max(m - 2, 0)
    if inner < max(_INNER, SERIES):
        return math.nan
    for s in range(SERIES):
        i, j = divmod(s * inner // SERIES, m - 2)
        for a in range(2):
            values[2 * s + a] = abs(bend(displacement, i + 1, j + 1, a)) / OF_STENCIL
    found, of_field = ranked(values[: 2 * SERIES], SERIES // 2) / OF_QUARTILE, _BEND * size_of(displacement)
    return math.sqrt(max(found * found - of_field * of_field, 0.0))


@compiled
def size_of(displacement: FloatArray) -> float:
    """Root mean square of a component of displacement [n, m, 3] about its mean, m; of evenly chosen elements."""
    n, m, _ = displacement.shape
    count, place = min(n * m, SERIES), displacement.reshape(n * m, 3)
    x = y = z = xx = yy = zz = 0.0
    for s in range(count):
        e = s * n * m // count
        x, y, z = x + place[e, 0], y + place[e, 1], z + place[e, 2]
        xx, yy, zz = xx + place[e, 0] ** 2, yy + place[e, 1] ** 2, zz + place[e, 2] ** 2
    total = max(xx - x * x / count, 0.0) + max(yy - y * y / count, 0.0) + max(zz - z * z / count, 0.0)
    return math.sqrt(total / (3 * count))


@compiled
def bend(field: FloatArray, i: int, j: int, a: int) -> float:
    """Second difference along of the second difference across; 0 of a field whose every line or column is straight."""
    total = 0.0
    for k in range(-1, 2):
        line = field[i + k, j - 1, a] - 2.0 * field[i + k, j, a] + field[i + k, j + 1, a]
        total += -2.0 * line if k == 0 else line
    return total


@compiled
def seek_steps(displacement: FloatArray, found: FloatArray, series: FloatArray) -> None:
    """Keep in ``found`` what ``seek_step`` does of places in the plane, and then of depth; evenly chosen elements."""
    if min(found[1], found[3]) > 0.0:  # as long as neither is sought, as in most frames, no place is looked at
        found[1], found[3] = found[1] - 1.0, found[3] - 1.0
        return
    n, m, _ = displacement.shape
    count = min(n * m, SERIES)
    place = displacement.reshape(n * m, 3)
    for s in range(count):
        e = s * n * m // count
        series[0, s], series[1, s] = place[e, 0], place[e, 1]
    seek_step(series[:, :count], found[:2])
    for s in range(count):
        series[0, s] = place[s * n * m // count, 2]
    seek_step(series[:1, :count], found[2:4])


@compiled
def step_in_plane(found: FloatArray) -> float:
    """The step of places in the plane; that of depth while there are too few different places to have one."""
    return float(found[2] if found[0] == 0.0 and found[1] == 0.0 else found[0])


@compiled
def seek_step(values: FloatArray, found: FloatArray) -> None:
    """Keep in ``found`` the step of which all values are multiples, 0 while there is none, and for how many more frames
    none is sought: what has none now will hardly have one soon.

    The step is the greatest common divisor of all values in frames so far (Euclid's algorithm on reals). Two values
    that differ are multiples of something by themselves, three hardly ever.
    """
    if found[1] > 0.0:
        found[1] -= 1.0
        return
    step, levels, first, second = found[0], 1, values[0, 0], math.nan
    for value in values.flat:
        step = common_divisor(abs(value), step)
        if 0.0 < step <= _FINEST:
            found[0], found[1] = 0.0, _MEMORY
            return
        if levels < _LEVELS and abs(value - first) > _FINEST and not abs(value - second) <= _FINEST:
            levels, second = levels + 1, value
    if found[0] > 0.0 or levels >= _LEVELS:
        found[0] = step


@compiled
def common_divisor(one: float, other: float) -> float:
    """The greatest number of which both, at least 0, are multiples to within ``NOISE.least_step``."""
    while other > _LEAST:
        rest = one - other * math.floor(one / other)
        one, other = other, min(rest, other - rest)
    return one
