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


def moving_mean(time: FloatArray, values: FloatArray, bounds: IntArray, window: float) -> tuple[FloatArray, FloatArray]:
    """Mean [k] of ``values`` [k] over ``window`` s about each frame, and of how many, [k]; NaN are left out, and stay
    where all are.

    Of several patches, as ``local_rates``.
    """
    mean, count = np.full(len(time), np.nan), np.zeros(len(time))
    _fill_means(for_kernels(time), for_kernels(values), bounds, window, mean, count)
    return mean, count


@compiled
def _fill_rates(
    time: FloatArray, values: FloatArray, bounds: IntArray, window: float, slope: FloatArray, error: FloatArray
) -> None:
    for p in range(len(bounds) - 1):
        span = slice(bounds[p], bounds[p + 1])
        for column in range(values.shape[1]):
            _fill_lines(time[span], values[span, column], window, slope[span, column], error[span, column])


@compiled
def _fill_lines(time: FloatArray, series: FloatArray, window: float, slope: FloatArray, error: FloatArray) -> None:
    sums, _ = _sums_in_windows(time, series, window)
    for e in range(len(series)):
        if math.isfinite(series[e]):
            slope[e], error[e] = _line(sums[e])


@compiled
def _fill_means(
    time: FloatArray, values: FloatArray, bounds: IntArray, window: float, mean: FloatArray, count: FloatArray
) -> None:
    for p in range(len(bounds) - 1):
        span = slice(bounds[p], bounds[p + 1])
        _fill_mean(time[span], values[span], window, mean[span], count[span])


@compiled
def _fill_mean(time: FloatArray, series: FloatArray, window: float, mean: FloatArray, count: FloatArray) -> None:
    sums, middle = _sums_in_windows(time, series, window)
    for e in range(len(series)):
        count[e] = sums[e, 0]
        if sums[e, 0] > 0.0:
            mean[e] = middle[e] + sums[e, 2] / sums[e, 0]


@compiled
def _sums_in_windows(time: FloatArray, series: FloatArray, window: float) -> tuple[FloatArray, FloatArray]:
    """Sums [k, 6] of ``_running_sums`` over each frame's window, and the mean [k] about which its values are taken."""
    sums, middle = np.empty((len(series), 6)), np.empty(len(series))
    begin = first = last = 0
    while begin < len(series):
        first, end, reach = _stretch(time, begin, window, first, last)
        origin, last, (running, centre) = first, end, _running_sums(time[first:reach], series[first:reach])
        for e in range(begin, end):
            first, last = _window(time, e, window, first, last)
            for column in range(6):
                sums[e, column] = running[last - origin, column] - running[first - origin, column]
            middle[e] = centre
        begin = end
    return sums, middle


@compiled
def _stretch(time: FloatArray, begin: int, window: float, first: int, last: int) -> tuple[int, int, int]:
    """First frame of the window of frame ``begin``, the one after it, and the one after the window of its last frame.

    Sums run anew over each such stretch: over a long log their differences would lose what a window holds.
    """
    first, last = _window(time, begin, window, first, last)
    return first, last, _window(time, last - 1, window, first, last)[1]


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
def _running_sums(time: FloatArray, series: FloatArray) -> tuple[FloatArray, float]:
    """Sums [k + 1, 6] of 1, t, y, t², ty, y² over all frames before each, of a series [k] whose NaN are left out.

    Times and values are taken about their means: sums of squares then cancel least. That of the values comes with them.
    """
    sums, began, middle = np.zeros((len(series) + 1, 6)), time.mean(), _middle(series)
    for e in range(len(series)):
        sums[e + 1] = sums[e]
        if math.isfinite(series[e]):
            t, y = time[e] - began, series[e] - middle
            for column, each in enumerate((1.0, t, y, t * t, t * y, y * y)):
                sums[e + 1, column] += each
    return sums, middle


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
def _line(sums: FloatArray) -> tuple[float, float]:
    """Slope of the line through what has these sums [6] (see ``_running_sums``), and its standard error."""
    n, st, sy, stt, sty, syy = sums
    if n < _RATE_FRAMES:
        return math.nan, math.nan
    spread = stt - st * st / n
    slope = (sty - st * sy / n) / spread
    rest = max(syy - sy * sy / n - slope * slope * spread, 0.0)
    return slope, math.sqrt(rest / (n - 2.0) / spread)
