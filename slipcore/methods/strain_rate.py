"""The paper's method, corrected: extreme events of the signed strain rate, in physical time."""

import math
from dataclasses import dataclass, replace

import numpy as np

from slipcore.defaults import StrainRateOptions
from slipcore.events import RunningScore, init_score, step_score
from slipcore.frames import BoolArray, FloatArray
from slipcore.methods.interface import Decision, Method, Observation
from slipcore.strain import Lattice, frobenius, signed_rate, surface_strain


@dataclass(frozen=True, slots=True, eq=False)
class StrainRateState:
    """``strain`` and its low-passed ``rate`` [3, n, m]; running ``score``; ``age`` s in contact and ``slip`` [n, m]."""

    strain: FloatArray
    rate: FloatArray
    score: RunningScore
    age: FloatArray
    slip: BoolArray


def init(lattice: Lattice, seen: Observation, _: StrainRateOptions) -> StrainRateState:
    """Start at rest."""
    shape = seen.contact.shape
    strain = surface_strain(lattice, seen.steps, seen.normal)
    return StrainRateState(strain, np.zeros((3, *shape)), init_score(shape), np.zeros(shape), np.zeros(shape, bool))


def step(
    state: StrainRateState, lattice: Lattice, seen: Observation, options: StrainRateOptions
) -> tuple[StrainRateState, Decision]:
    """A positive extreme of the signed rate begins slip, a negative one ends it; in between the state holds."""
    strain = surface_strain(lattice, seen.steps, seen.normal)
    if math.isnan(seen.noise):  # a rate that may be noise alone would live on in the low-pass
        return replace(state, strain=strain), Decision(state.slip, state.slip.astype(float))
    strain_noise = seen.noise * lattice.strain_noise
    forgotten = _forgotten(seen.interval, _smoothing_time(strain_noise, options))
    rate = state.rate + forgotten * ((strain - state.strain) / seen.interval - state.rate)
    age = np.where(seen.contact & ~seen.touched, state.age + seen.interval, 0.0)
    settled = age > options.settling_time
    signal = np.where(settled, signed_rate(strain, rate), 0.0)
    floor = np.maximum(options.rate_floor, strain_noise * _noise_gain(seen.interval, forgotten))
    score, events = step_score(
        _forget(state.score, settled),
        signal,
        seen.interval,
        floor,
        time_constant=options.memory_time,
        threshold=options.threshold,
        influence=options.influence,
    )
    least = options.threshold * floor
    onset = (events > 0) & (signal > np.maximum(least, options.growth_rate * frobenius(strain)))
    end = (events < 0) & (signal < -least)
    slip = (state.slip | onset) & ~end & settled
    return StrainRateState(strain, rate, score, age, slip), Decision(slip, slip.astype(float))


def _forget(score: RunningScore, settled: BoolArray) -> RunningScore:
    """Each touch begins a new story: what pressing did to the strain says nothing of how it scatters in stick."""
    return RunningScore(score.mean * settled, score.variance * settled)


def _smoothing_time(strain_noise: FloatArray, options: StrainRateOptions) -> float:
    """As much low-pass as the noise calls for: its trace in the rate is about strain noise over time constant."""
    wanted = float(strain_noise.mean()) / options.rate_floor
    return min(max(wanted, options.smoothing_time), max(options.longest_smoothing_time, options.smoothing_time))


def _forgotten(interval: float, time_constant: float) -> float:
    """Weight of the newest rate: exact for a first-order low-pass and a strain that moves in straight lines."""
    return -math.expm1(-interval / time_constant) if time_constant > 0.0 else 1.0


def _noise_gain(interval: float, forgotten: float) -> float:
    """Standard deviation of the low-passed rate, 1/s, for white noise of 1 in the strain at equal intervals."""
    return forgotten / interval * math.sqrt(2.0 / (2.0 - forgotten))


METHOD = Method(StrainRateOptions, init, step)
