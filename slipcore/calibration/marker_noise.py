"""Noise of markers while nothing touches, and how long it remembers.

By the variogram, the mean square of a coordinate's change over a lag, which no mean or trend of few frames biases:
D(k) = 2 σ_w² + 2 σ_c² (1 − φᵏ) for white noise beside a first-order autoregressive process.
"""

import math

import numpy as np
from scipy.special import ndtri

from slipcore.calibration.defaults import ESTIMATE
from slipcore.calibration.estimate import Estimate, unknown
from slipcore.calibration.press import PressLog
from slipcore.frames import BoolArray, FloatArray
from slipcore.noise_memory import fit_memory, longest_memory


def marker_noise(presses: list[PressLog]) -> tuple[Estimate, Estimate]:
    """Standard deviation of a marker's coordinate in the plane, m, and its correlation from frame to frame.

    Motion that all markers have in common is not in it. Intervals are those of a jackknife over groups of elements.
    """
    names = ("marker_noise", "m"), ("marker_noise_correlation", "-")
    usable = [press for press in presses if np.count_nonzero(press.free) >= ESTIMATE.free_frames]
    if not usable:
        reason = f"fewer than {ESTIMATE.free_frames} frames without contact: begin before the touch"
        return unknown(*names[0], reason), unknown(*names[1], reason)
    count = usable[0].log.grid[0] * usable[0].log.grid[1]
    if count < ESTIMATE.noise_series:
        reason = f"{count} elements; {ESTIMATE.noise_series} are needed"
        return unknown(*names[0], reason), unknown(*names[1], reason)
    squares = _mean_squares(usable)
    if not squares.any():
        reason = "no marker's reading changes while nothing touches: it is rounded, or held back"
        return unknown(*names[0], reason), unknown(*names[1], reason)
    whole = np.array(_fit(squares.mean(axis=1)))
    blocks = min(ESTIMATE.noise_blocks, count)
    parts = np.array([_fit(np.delete(squares, np.s_[k::blocks], axis=1).mean(axis=1)) for k in range(blocks)])
    error = np.sqrt((blocks - 1) / blocks * ((parts - parts.mean(axis=0)) ** 2).sum(axis=0))
    half = float(ndtri(0.5 + 0.5 * ESTIMATE.confidence)) * error
    return _bounded(names[0], whole[0], half[0], math.inf), _bounded(names[1], whole[1], half[1], 1.0)


def _bounded(name: tuple[str, str], value: float, half: float, most: float) -> Estimate:
    return Estimate(*name, float(value), float(max(value - half, 0.0)), float(min(value + half, most)))


def _mean_squares(presses: list[PressLog]) -> FloatArray:
    """Mean square of each element's change over 1 … lags frames, [lags, k] m², of all presses.

    Only up to the first lag that no two free frames lie apart, as where as many are free before a press as after it.
    What is taken off as common, the mean over k elements, holds a share 1/k of the variance of their own noise.
    """
    lags = max(1, min(ESTIMATE.noise_lags, *(_longest_lag(press) for press in presses)))
    elements = presses[0].log.grid[0] * presses[0].log.grid[1]
    sums, pairs = np.zeros((lags, elements)), np.zeros(lags)
    for press in presses:
        plane = press.log.displacement[..., :2].reshape(len(press.log), -1, 2)
        still = plane - plane.mean(axis=1, keepdims=True)
        each = [_change(still, press.free, lag) for lag in range(1, lags + 1)]
        sums += [total for total, _ in each]
        pairs += [count for _, count in each]
    known = max(1, int(np.cumprod(pairs > 0.0).sum()))
    own = max(1.0 - 1.0 / elements, 1.0 / elements)
    shared: FloatArray = sums[:known] / np.maximum(pairs[:known], 1.0)[:, None] / own
    return shared


def _longest_lag(press: PressLog) -> int:
    return int(ESTIMATE.noise_share_of_frames * np.count_nonzero(press.free))


def _change(plane: FloatArray, free: BoolArray, lag: int) -> tuple[FloatArray, int]:
    """Sum of squares of each element's change [k] over a lag between free frames, and how many pairs there are."""
    pairs = free[lag:] & free[:-lag]
    change = (plane[lag:] - plane[:-lag])[pairs]
    return 0.5 * (change**2).sum(axis=(0, 2)), int(np.count_nonzero(pairs))


def _fit(variogram: FloatArray) -> tuple[float, float]:
    """Standard deviation, and correlation from frame to frame, of the process that fits best to D(1 …) [lags]."""
    lag = np.arange(1, len(variogram) + 1)
    longest = longest_memory(len(lag))
    found = fit_memory(
        0.5 * variogram, lambda memory: np.stack([np.ones(len(lag)), 1.0 - memory**lag], axis=1), longest
    )
    return found.deviation, found.correlation
