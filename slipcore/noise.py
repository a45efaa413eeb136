"""Measurement noise from three frames, by medians."""

import math

import numpy as np

from slipcore.compilation import compiled
from slipcore.defaults import DEVIATION_TO_SIGMA, NOISE
from slipcore.frames import FloatArray

_LEAST, _MEMORY = NOISE.least_series, NOISE.memory


@compiled
def median(values: FloatArray) -> float:
    """Upper median of values [k]; their order is changed."""
    return ranked(values, len(values) // 2)


@compiled
def ranked(values: FloatArray, rank: int) -> float:
    """The value [k] that so many of them precede in order, by selection; their order is changed.

    Partitioned without a branch in the inner loop (Lomuto), which random values would mispredict every other time, at
    the median of five of them, which leaves about half as many to go through as any single one.
    """
    low, high = 0, len(values)
    while True:
        pivot = middle_of_five(values, low, (high - low) // 5)
        less = low
        for k in range(low, high):
            value = values[k]
            values[k], values[less] = values[less], value
            less += value < pivot
        if rank < less:
            high = less
        elif less > low:
            low = less
        else:  # none is less: put aside all that are not greater
            for k in range(low, high):
                value = values[k]
                values[k], values[less] = values[less], value
                less += not value > pivot  # true of NaN, too
            if rank < less:
                return float(pivot)
            low = less


@compiled
def middle_of_five(values: FloatArray, first: int, step: int) -> float:
    """The median of the five values from ``first`` on, a ``step`` apart; of numbers alone."""
    a, b, c = values[first], values[first + step], values[first + 2 * step]
    d, e = values[first + 3 * step], values[first + 4 * step]
    larger, smaller = max(min(a, b), min(c, d)), min(max(a, b), max(c, d))
    return float(max(min(e, larger), min(max(e, larger), smaller)))


@compiled
def noise_of_three(
    first: FloatArray, middle: FloatArray, last: FloatArray, share: float, residual: FloatArray
) -> float:
    """Standard deviation of one value of the series [axes, k], the middle ``share`` of the time from first to last.

    The middle is compared with the line through its neighbours. Each axis gives a median absolute deviation about its
    own median over the k series (a common jerk drops out), leaving out series that did not change at all. NaN where
    fewer than ``NOISE.least_series`` changed. ``residual``: room for [axes, k] or more.
    """
    axes, k = first.shape
    count = 0
    for s in range(k):
        changed = True
        for a in range(axes):
            residual[a, count] = middle[a, s] - ((1.0 - share) * first[a, s] + share * last[a, s])
            changed &= residual[a, count] != 0.0
        if not changed:  # a sensor that repeats a value, or is at rest behind a dead zone
            for a in range(axes):
                changed |= residual[a, count] != 0.0
        count += changed
    if count < _LEAST:
        return math.nan
    total = 0.0
    for a in range(axes):
        about = median(residual[a, :count])
        for s in range(count):
            residual[a, s] = abs(residual[a, s] - about)
        total += median(residual[a, :count]) ** 2
    gain = math.sqrt(1.0 + (1.0 - share) ** 2 + share**2)
    return DEVIATION_TO_SIGMA * math.sqrt(total / axes) / gain


@compiled
def remember(recent: FloatArray, estimate: float) -> None:
    """Put an estimate into a ring, a count of how many there were and the last of them; NaN is no estimate."""
    if not math.isnan(estimate):
        recent[1 + int(recent[0]) % _MEMORY] = estimate
        recent[0] += 1.0


@compiled
def recent_median(recent: FloatArray, ordered: FloatArray) -> float:
    """Median of the estimates in a ring (a moment of fast change drops out); NaN while there is none.

    Rounded up, to double at first, while there are few: too little noise does more harm than too much. ``ordered``:
    room for all of them.
    """
    count = min(int(recent[0]), _MEMORY)
    if count == 0:
        return math.nan
    for k in range(count):
        ordered[k] = recent[1 + k]
    return median(ordered[:count]) * (1.0 + 1.0 / count - 1.0 / _MEMORY)


@compiled
def noise_of_series(time: FloatArray, series: FloatArray) -> float:
    """Noise of recorded series [t, axes, k]: the median of the last estimates; NaN for fewer than 3 frames."""
    recent, residual = np.zeros(1 + _MEMORY), np.empty(series.shape[1:])
    for t in range(len(time) - 1, 1, -1):
        if recent[0] == _MEMORY:
            break
        share = (time[t - 1] - time[t - 2]) / (time[t] - time[t - 2])
        remember(recent, noise_of_three(series[t - 2], series[t - 1], series[t], share, residual))
    return recent_median(recent, np.empty(_MEMORY))


def estimate_noise(time: FloatArray, series: FloatArray) -> float:
    """Standard deviation of one value of recorded series [t, axes, k]; NaN for fewer than 3 frames.

    As a detector estimates it online: the middle of three values is compared with the line through its neighbours, at
    the true times, so that uneven frames do no harm, and of the last frames' estimates the median counts.
    """
    return float(noise_of_series(np.ascontiguousarray(time), np.ascontiguousarray(series)))
