"""Extreme events of a signal, counted in frames: running z-scores as van Brakel has them and the paper uses ([42]).

An event is +1 where the signal jumps up, −1 where it drops, 0 elsewhere.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from slipcore.frames import FloatArray

EventArray = NDArray[np.int8]


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
