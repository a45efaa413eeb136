"""Noise of the forces on a contact as a whole, and how long it lasts.

Over half a second a load changes as well, and no series of it alone shows which of the two that is: what does not
change smoothly counts as noise, unless elements that bear no load show less.
"""

import math
from statistics import NormalDist
from typing import NamedTuple

import numpy as np
from scipy.special import stdtrit

from slipcore.compilation import compiled
from slipcore.defaults import DEVIATION_TO_SIGMA, NORMAL_95, PATCHES
from slipcore.frames import FloatArray
from slipcore.noise import median
from slipcore.noise_memory import WHITE, Lasting, fit_lasting, lags_within
from slipcore.patch.regions import NOWHERE
from slipcore.patch.resultants import felt_by
from slipcore.patch.spans import IntArray, Spans, elements_at, for_kernels

_FREE_FRAMES = PATCHES.free_frames


class SumNoise(NamedTuple):
    """Noise [k, 2] N on an element, across the normal and along it, by which the sums of a patch would be as noisy as
    they are; and in how many ``frames`` [k] in a row it is no less sure than in one.
    """

    noise: FloatArray
    frames: FloatArray


class PatchLoads(NamedTuple):
    """On the patches, in each of their frames: F_x, F_y, M and F_n [k, 4] as in ``Resultants``, the variances
    ``squares`` [k, 4] that noise of 1 N on each element gives these, and the ``axes`` [k, 3, 3] of x, y and the normal.
    """

    loads: FloatArray
    squares: FloatArray
    axes: FloatArray


class FreeSums(NamedTuple):
    """What elements that bear no load changed by in frames, at lags: ``sums`` [lags, t, 3] N over the largest square of
    them, and its ``sides`` [lags, t], 0 where there is none.
    """

    sums: FloatArray
    sides: IntArray


def noise_of_sums(
    time: FloatArray,
    force: FloatArray,
    normal: FloatArray,
    place: FloatArray,
    spans: Spans,
    window: float,
    lasting: Lasting = WHITE,
) -> SumNoise:
    """Of F_x, F_y, M and F_n of ``resultants``, within ``window`` s, of elements whose own noise is ``lasting``.

    Each value is compared with the line through those before and after it, at ``time`` [t] s, over the noise that 1 N
    on each of their elements would give that: elements come and go. Medians are taken over a patch's frames (those that
    did not change left out), of the first three the noisiest counts. Noise that elements share or smooth adds up in
    sums to more than their own shows; that of a patch of few elements shows here alone. 0 where fewer than three frames
    show it.

    It lasts as that of the elements does; where that does not, as sums over more and more frames show. Where elements
    bear nothing and change, sums over the largest square of them show the noise without any load: then it is no more
    than that, though no less than three frames of the patch show.
    """
    count, lasts = len(spans.frame), lasting
    loads = PatchLoads(np.empty((count, 4)), np.empty((count, 4)), np.empty((count, 3, 3)))
    _fill_loads(for_kernels(force), for_kernels(normal), for_kernels(place), spans, loads)
    lags, seconds = lags_within(time, window, int(np.diff(spans.bounds).max())), time[spans.frame]
    sums = np.array([_against_lines(seconds, spans, loads, lag) for lag in (lags if len(lags) else (1,))])
    if lasting == WHITE and len(lags):
        lasts = _lasting_of(lags, sums[..., :3], spans)
    shown = np.stack([sums[0, :, :3].max(axis=1), sums[0, :, 3]], axis=-1)
    noise, frames = lasts.gain * shown, np.full(len(shown), lasts.frames)
    if lasts != WHITE and len(lags):
        free, frees = _without_load(time, for_kernels(force), spans, loads, lags)
        frames[(free < noise).any(axis=1)] = max(lasting.frames, frees.frames)
        noise = np.clip(free, shown, noise)
    return SumNoise(*(np.repeat(each, np.diff(spans.bounds), axis=0) for each in (noise, frames)))


def _lasting_of(lags: IntArray, noise: FloatArray, spans: Spans) -> Lasting:
    """Of values of which each patch shows this ``noise`` [lags, p, axes], as far as it does at all of the lags.

    Few of them say something of their own: noise counts as so much larger, and longer, as 97.5 % of Student's
    distribution lie further out than those of the normal one.
    """
    square = (noise**2).mean(axis=-1)
    known = (square > 0.0).all(axis=0)
    if not known.any():
        return WHITE
    found = fit_lasting(lags, (square[:, known] / square[0, known]).mean(axis=1))
    values = float((np.diff(spans.bounds) * np.count_nonzero(noise[0], axis=-1))[known].sum()) / found.frames
    wider = float(stdtrit(values, NormalDist().cdf(NORMAL_95))) / NORMAL_95
    return Lasting(found.gain * wider, found.frames * wider**2)


def _against_lines(time: FloatArray, spans: Spans, loads: PatchLoads, lag: int) -> FloatArray:
    """What each of the sums of each patch, [p, 4], shows against those so many frames before and after."""
    noise = np.zeros((len(spans.bounds) - 1, 4))
    _fill_noise(time, spans.bounds, loads, lag, noise)
    return noise


def _without_load(
    time: FloatArray, force: FloatArray, spans: Spans, loads: PatchLoads, lags: IntArray
) -> tuple[FloatArray, Lasting]:
    """Noise [p, 2] N on an element, across the normal and along it, as elements that bear no load show it, and how it
    lasts; infinite where they do not.
    """
    noise = np.zeros((len(lags), len(spans.bounds) - 1, 3))
    free = FreeSums(np.empty((len(lags), len(time), 3)), np.zeros((len(lags), len(time)), np.int64))
    _fill_sums(time, force, spans, lags, free)
    _fill_free(time, spans, loads, lags, free, noise)
    lasting = _lasting_of(lags, noise, spans)
    found = lasting.gain * np.stack([noise[0, :, :2].max(axis=1), noise[0, :, 2]], axis=-1)
    found[(noise == 0.0).any(axis=(0, 2))] = np.inf
    return found, lasting


@compiled
def _fill_loads(force: FloatArray, normal: FloatArray, place: FloatArray, spans: Spans, found: PatchLoads) -> None:
    for e, k in enumerate(spans.frame):
        patch = elements_at(spans, e)
        pressing, arm, load, axes = felt_by(force[k], normal[k], place[k], patch)
        found.loads[e, :3], found.loads[e, 3] = load, pressing.sum()
        found.squares[e], found.squares[e, 2] = len(patch), (arm * arm).sum()
        found.axes[e] = axes


@compiled
def _fill_noise(time: FloatArray, bounds: IntArray, loads: PatchLoads, lag: int, noise: FloatArray) -> None:
    """Of each of the sums of each patch, [p, 4]; ``time`` [k] of their frames."""
    for p in range(len(bounds) - 1):
        begin, end = bounds[p], bounds[p + 1]
        for axis in range(4):
            residual, count = np.empty(end - begin), 0
            load, square = loads.loads[:, axis], loads.squares[:, axis]
            for e in range(begin + lag, end - lag):
                late = (time[e] - time[e - lag]) / (time[e + lag] - time[e - lag])
                off = load[e] - (1.0 - late) * load[e - lag] - late * load[e + lag]
                variance = square[e] + (1.0 - late) ** 2 * square[e - lag] + late**2 * square[e + lag]
                if off != 0.0 and math.isfinite(off) and variance > 0.0:
                    residual[count] = abs(off) / math.sqrt(variance)
                    count += 1
            if count > 0:
                noise[p, axis] = DEVIATION_TO_SIGMA * median(residual[:count])


@compiled
def _fill_free(
    time: FloatArray, spans: Spans, loads: PatchLoads, lags: IntArray, free: FreeSums, noise: FloatArray
) -> None:
    """Of sums over elements without load along the axes of each patch, [lags, p, 3]; 0 where too few frames have such.

    A sum over fewer elements than the patch has counts as if all of its noise were common to them.
    """
    residual = np.empty((3, len(spans.frame)))
    for s in range(len(lags)):
        lag = lags[s]
        for p in range(len(spans.bounds) - 1):
            count = 0
            for e in range(spans.bounds[p], spans.bounds[p + 1]):
                k = spans.frame[e]
                side = free.sides[s, k]
                if side == 0 or not math.isfinite(loads.loads[e, 0]):
                    continue
                late = (time[k] - time[k - lag]) / (time[k + lag] - time[k - lag])
                alike = max(math.sqrt(loads.squares[e, 0]) / side, 1.0)
                share = alike / (side * math.sqrt(1.0 + (1.0 - late) ** 2 + late**2))
                for axis in range(3):
                    residual[axis, count] = share * abs((loads.axes[e, axis] * free.sums[s, k]).sum())
                count += 1
            if count >= _FREE_FRAMES:
                for axis in range(3):
                    noise[s, p, axis] = DEVIATION_TO_SIGMA * median(residual[axis, :count])


@compiled
def _fill_sums(time: FloatArray, force: FloatArray, spans: Spans, lags: IntArray, free: FreeSums) -> None:
    """Of the frames of patches, each once, at all lags: the forces around it are then read from memory once."""
    off, room = np.zeros(force.shape[1:]), np.zeros((force.shape[1] + 1, force.shape[2] + 1), np.int64)
    seen = np.zeros(len(time), np.bool_)
    for k in spans.frame:
        if seen[k]:
            continue
        seen[k] = True
        for s in range(len(lags)):
            lag = lags[s]
            if lag <= k < len(time) - lag:
                late = (time[k] - time[k - lag]) / (time[k + lag] - time[k - lag])
                _find_changes(force, spans.labels, k, lag, late, off)
                free.sides[s, k] = _sum_of_square(off, room, free.sums[s, k])


@compiled
def _find_changes(force: FloatArray, labels: IntArray, k: int, lag: int, late: float, off: FloatArray) -> None:
    """Fill by what forces differ from the line through those ``lag`` frames before and after, ``off`` [n, m, 3] N: of
    elements that are of no patch in these three frames; 0 for others.
    """
    n, m, _ = off.shape
    for i in range(n):
        for j in range(m):
            free = max(labels[k - lag, i, j], labels[k, i, j], labels[k + lag, i, j]) == NOWHERE
            for axis in range(3):
                line = force[k, i, j, axis] - (1.0 - late) * force[k - lag, i, j, axis]
                off[i, j, axis] = line - late * force[k + lag, i, j, axis] if free else 0.0


@compiled
def _sum_of_square(off: FloatArray, room: IntArray, total: FloatArray) -> int:
    """Side of the largest square of elements that changed, and the ``total`` [3] of what these changed by, ``off``."""
    row, column, side = _largest_square(off, room)
    total[:] = 0.0
    for i in range(row - side + 1, row + 1):
        for j in range(column - side + 1, column + 1):
            for axis in range(3):
                total[axis] += off[i, j, axis]
    return side


@compiled
def _largest_square(off: FloatArray, room: IntArray) -> tuple[int, int, int]:
    """Last row and column, and side, of the largest square of elements that changed by ``off`` [n, m, 3]: forces that a
    sensor sets to 0 show nothing. ``room``: [n + 1, m + 1], of which the first row and column are 0.
    """
    row = column = side = 0
    for i in range(off.shape[0]):
        for j in range(off.shape[1]):
            if off[i, j, 0] != 0.0 or off[i, j, 1] != 0.0 or off[i, j, 2] != 0.0:
                room[i + 1, j + 1] = 1 + min(room[i, j], room[i, j + 1], room[i + 1, j])
                if room[i + 1, j + 1] > side:
                    row, column, side = i, j, room[i + 1, j + 1]
            else:
                room[i + 1, j + 1] = 0
    return row, column, side
