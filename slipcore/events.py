"""Extreme events of a signal in real time (stage 3: events): running z-scores as streaming state.

Two variants: one in physical time, and the one by van Brakel that the paper uses ([42]), counted in frames.
An event is +1 where the signal jumps up, −1 where it drops, 0 elsewhere.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from slipcore.frames import FloatArray

EventArray = NDArray[np.int8]


@dataclass(frozen=True, slots=True, eq=False)
class RunningScore:
    """Exponentially forgetting mean and variance of a signal [...]."""

    mean: FloatArray
    variance: FloatArray


def init_score(shape: tuple[int, ...]) -> RunningScore:
    """No signal seen yet: mean and variance zero, so that the floor alone judges the first values."""
    return RunningScore(np.zeros(shape), np.zeros(shape))


def step_score(
    state: RunningScore,
    signal: FloatArray,
    interval: float,
    floor: FloatArray | float,
    *,
    time_constant: float,
    threshold: float,
    influence: float,
) -> tuple[RunningScore, EventArray]:
    """Judge one value of each signal against its past, then learn from it.

    ``interval`` since the last value and ``time_constant`` of forgetting in s; ``floor`` > 0 under the standard
    deviation, in the signal's unit; an event is beyond ``threshold`` standard deviations and is learnt from with
    weight ``influence``. What is remembered depends on the time passed, not on the number of frames.
    """
    spread = np.maximum(np.sqrt(state.variance), floor)
    surprise = signal - state.mean
    extreme = np.abs(surprise) > threshold * spread
    events = (np.sign(surprise) * extreme).astype(np.int8)
    surprise *= np.where(extreme, influence, 1.0)
    forgotten = -math.expm1(-interval / time_constant)
    mean = state.mean + forgotten * surprise
    variance = (1.0 - forgotten) * (state.variance + forgotten * surprise * surprise)
    return RunningScore(mean, variance), events


@dataclass(frozen=True, slots=True, eq=False)
class LaggedScore:
    """The last ``lag`` filtered values [lag, ...] of a signal, and how many have been seen."""

    filtered: FloatArray
    seen: int


def init_lagged_score(shape: tuple[int, ...], lag: int) -> LaggedScore:
    """No signal seen yet."""
    return LaggedScore(np.zeros((lag, *shape)), 0)


def step_lagged_score(
    state: LaggedScore, signal: FloatArray, floor: float, *, threshold: float, influence: float
) -> tuple[LaggedScore, EventArray]:
    """Van Brakel's robust peak detection by z-scores: compare with the mean of the last ``lag`` filtered values.

    The first ``lag`` values only fill the window. ``floor`` under the standard deviation, in the signal's unit.
    """
    lag = len(state.filtered)
    if state.seen < lag:
        events, kept = np.zeros(signal.shape, np.int8), signal
    else:
        surprise = signal - state.filtered.mean(axis=0)
        extreme = np.abs(surprise) > threshold * np.maximum(state.filtered.std(axis=0), floor)
        events = (np.sign(surprise) * extreme).astype(np.int8)
        last = state.filtered[(state.seen - 1) % lag]
        kept = np.where(extreme, influence * signal + (1.0 - influence) * last, signal)
    filtered = state.filtered.copy()
    filtered[state.seen % lag] = kept
    return LaggedScore(filtered, state.seen + 1), events
