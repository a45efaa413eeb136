"""Measurement noise, estimated while a stream runs."""

import math
from dataclasses import dataclass

import numpy as np

from slipcore.defaults import NOISE
from slipcore.frames import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class NoiseState:
    """What an online noise estimate remembers: the last two values of each series, and recent estimates.

    ``sigma``: estimated standard deviation of one value, in the series' unit; NaN before it can be estimated.
    """

    before: tuple[tuple[float, FloatArray], ...] = ()
    recent: tuple[float, ...] = ()
    sigma: float = math.nan


NOTHING_SEEN = NoiseState()


def step_noise(state: NoiseState, time: float, series: FloatArray) -> NoiseState:
    """Learn from one more value of each series: [axes, k], taken at ``time`` s.

    The middle of three values is compared with the line through its neighbours, at the true times, so that uneven
    frames do no harm. Each axis gives a median absolute deviation about its own median over the k series (a common
    jerk drops out), leaving out series that did not change at all; of the last frames' estimates the median counts
    (a moment of fast change drops out).
    """
    kept = (*state.before[-1:], (time, series))
    if len(state.before) < 2:
        return NoiseState(kept, state.recent, state.sigma)
    (t0, first), (t1, middle) = state.before
    share = (t1 - t0) / (time - t0)
    residual = middle - ((1.0 - share) * first + share * series)
    if not residual.all():  # a sensor that repeats a value, or is at rest behind a dead zone
        residual = residual[:, residual.any(axis=0)]
    if residual.shape[1] < NOISE.least_series:
        return NoiseState(kept, state.recent, state.sigma)
    gain = math.sqrt(1.0 + (1.0 - share) ** 2 + share**2)
    deviation = _median(np.abs(residual - _median(residual)[:, None]))
    estimate = NOISE.deviation_to_sigma * math.sqrt(float(deviation @ deviation) / len(deviation)) / gain
    recent = (*state.recent[1 - NOISE.memory :], estimate)
    return NoiseState(kept, recent, sorted(recent)[len(recent) // 2])


def estimate_noise(time: FloatArray, series: FloatArray) -> float:
    """Noise of recorded series [t, axes, k]: the online estimate after the last frame; NaN for fewer than 3 frames."""
    state = NOTHING_SEEN
    for moment, values in zip(time, series, strict=True):
        state = step_noise(state, float(moment), values)
    return state.sigma


def _median(values: FloatArray) -> FloatArray:
    middle = values.shape[-1] // 2
    return np.partition(values, middle, axis=-1)[..., middle]
