"""Rates of change over a moving window of time, and means."""

import math

import numpy as np

from slipcore.compilation import compiled
from slipcore.defaults import PATCHES
from slipcore.frames import FloatArray
from slipcore.patch.spans import IntArray, for_kernels

_ROUNDING, _RATE_FRAMES = PATCHES.rounding, PATCHES.rate_frames


def local_rates(time: FloatArray, values: FloatArray, bounds: IntArray, window: float) -> tuple[FloatArray, FloatArray]:
    """Slope [k, c] 1/s of ``values`` [k, c] over ``window`` s about each frame, and its standard error.

    Of several patches, one from each of the ``bounds`` up to the next; ``time`` [k] grows in each. By least squares;
    NaN in ``values`` are left out; the rate is NaN where too few are left.
    """
    slope, error = np.full(values.shape, np.nan), np.full(values.shape, np.nan)
    _fill_rates(for_kernels(time), for_kernels(values), bounds, window, slope, error)
    return slope, error


def moving_mean(time: FloatArray, values: FloatArray, bounds: IntArray, window: float) -> FloatArray:
    """Mean [k] of ``values`` [k] over ``window`` s about each frame; NaN are left out, and stay where all are.

    Of several patches, as ``local_rates``.
    """
    mean = np.full(len(time), np.nan)
    _fill_means(for_kernels(time), for_kernels(values), bounds, window, mean)
    return mean


@compiled
def _fill_rates(
    time: FloatArray, values: FloatArray, bounds: IntArray, window: float, slope: FloatArray, error: FloatArray
) -> None:
    for p in range(len(bounds) - 1):
        span = slice(bounds[p], bounds[p + 1])
        for column in range(values.shape[1]):
            series = values[span, column]
            sums = _running_sums(time[span], series)
            first = last = 0
            for e in range(len(series)):
                first, last = _window(time[span], e, window, first, last)
                if math.isfinite(series[e]):
                    slope[bounds[p] + e, column], error[bounds[p] + e, column] = _line(sums[first], sums[last])


@compiled
def _fill_means(time: FloatArray, values: FloatArray, bounds: IntArray, window: float, mean: FloatArray) -> None:
    for p in range(len(bounds) - 1):
        span = slice(bounds[p], bounds[p + 1])
        sums = _running_sums(time[span], values[span])
        middle = _middle(values[span])
        first = last = 0
        for e in range(bounds[p + 1] - bounds[p]):
            first, last = _window(time[span], e, window, first, last)
            count, total = sums[last, 0] - sums[first, 0], sums[last, 2] - sums[first, 2]
            if count > 0.0:
                mean[bounds[p] + e] = middle + total / count


@compiled
def _window(time: FloatArray, frame: int, window: float, first: int, last: int) -> tuple[int, int]:
    """First frame in a frame's window, and the one after its last, from those of an earlier frame."""
    half = 0.5 * window * (1.0 + _ROUNDING)
    while time[first] < time[frame] - half:
        first += 1
    while last < len(time) and time[last] <= time[frame] + half:
        last += 1
    return first, last


@compiled
def _running_sums(time: FloatArray, series: FloatArray) -> FloatArray:
    """Sums [k + 1, 6] of 1, t, y, t², ty, y² over all frames before each, of a series [k] whose NaN are left out.

    Times and values are taken about their means: sums of squares then cancel least.
    """
    sums, began, middle = np.zeros((len(series) + 1, 6)), time.mean(), _middle(series)
    for e in range(len(series)):
        sums[e + 1] = sums[e]
        if math.isfinite(series[e]):
            t, y = time[e] - began, series[e] - middle
            for column, each in enumerate((1.0, t, y, t * t, t * y, y * y)):
                sums[e + 1, column] += each
    return sums


@compiled
def _middle(series: FloatArray) -> float:
    """Mean of what is known, 0 where nothing is."""
    total, count = 0.0, 0
    for value in series:
        if math.isfinite(value):
            total += value
            count += 1
    return total / max(count, 1)


@compiled
def _line(first: FloatArray, last: FloatArray) -> tuple[float, float]:
    """Slope of the line through what is between two of the ``_running_sums``, and its standard error."""
    n, st, sy = last[0] - first[0], last[1] - first[1], last[2] - first[2]
    if n < _RATE_FRAMES:
        return math.nan, math.nan
    spread = last[3] - first[3] - st * st / n
    slope = (last[4] - first[4] - st * sy / n) / spread
    rest = max(last[5] - first[5] - sy * sy / n - slope * slope * spread, 0.0)
    return slope, math.sqrt(rest / (n - 2.0) / spread)
