"""Rates of change over a moving window of time."""

import numpy as np
from numpy.typing import NDArray

from slipcore.defaults import PATCHES
from slipcore.frames import FloatArray

IntArray = NDArray[np.int64]


def local_rates(time: FloatArray, values: FloatArray, window: float) -> tuple[FloatArray, FloatArray]:
    """Slope [t, k] 1/s of ``values`` [t, k] over ``window`` s about each frame, and its standard error.

    By least squares; NaN in ``values`` are left out; the rate is NaN where too few are left.
    """
    first, last = _bounds(time, window)
    known = np.isfinite(values)
    t = (time - time.mean())[:, None] * np.ones_like(values)
    y = np.where(known, values - _middle(values), 0.0)
    n, st, sy, stt, sty, syy = (
        _moving_sum(np.where(known, each, 0.0), first, last) for each in (np.ones_like(y), t, y, t * t, t * y, y * y)
    )
    with np.errstate(divide="ignore", invalid="ignore"):
        spread = stt - st * st / n
        slope = (sty - st * sy / n) / spread
        rest = np.maximum(syy - sy * sy / n - slope * slope * spread, 0.0)
        error = np.sqrt(rest / (n - 2.0) / spread)
    enough = (n >= PATCHES.rate_frames) & known
    return np.where(enough, slope, np.nan), np.where(enough, error, np.nan)


def moving_mean(time: FloatArray, values: FloatArray, window: float) -> FloatArray:
    """Mean [t] of ``values`` [t] over ``window`` s about each frame; NaN are left out, and stay where all are."""
    first, last = _bounds(time, window)
    known = np.isfinite(values)
    count, total = (_moving_sum(np.where(known, each, 0.0)[:, None], first, last)[:, 0] for each in (1.0, values))
    return np.asarray(np.divide(total, count, out=np.full(len(time), np.nan), where=count > 0))


def _bounds(time: FloatArray, window: float) -> tuple[IntArray, IntArray]:
    """First frame in each frame's window, and the one after its last."""
    half = 0.5 * window * (1.0 + PATCHES.rounding)
    return np.searchsorted(time, time - half), np.searchsorted(time, time + half, side="right")


def _middle(values: FloatArray) -> FloatArray:
    """Mean of the columns, 0 where nothing is known: sums of squares then cancel least."""
    known = np.isfinite(values)
    return np.asarray(np.where(known, values, 0.0).sum(axis=0) / np.maximum(known.sum(axis=0), 1))


def _moving_sum(values: FloatArray, first: IntArray, last: IntArray) -> FloatArray:
    sums = np.vstack([np.zeros(values.shape[1]), np.cumsum(values, axis=0)])
    return np.asarray(sums[last] - sums[first])
