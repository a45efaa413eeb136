"""One step of method ``strain_rate``: extreme events of the signed strain rate, in physical time."""

import math
from typing import NamedTuple

import numpy as np

from slipcore.compilation import compiled, unpack
from slipcore.defaults import LIMITS
from slipcore.detection.shared.records import Decision, DetectorSetup, Surface
from slipcore.frames import BoolArray, FloatArray
from slipcore.surface.normals import steps_at

XX, YY, XY, RATE_XX, RATE_YY, RATE_XY, MEAN, VARIANCE, AGE, SLIP, NOISE = range(11)
ROWS = 11
"""Memory of an element: strain, its low-passed rate 1/s, running mean and variance of the signal, s in contact, slip;
and what does not change, its strain's noise for marker noise of 1, 1/m."""
_LEAST_NORMAL = 1.0 / LIMITS.inclination


class StrainRateSettings(NamedTuple):
    """``StrainRateOptions`` as numbers for the kernel, in the same units, and the lattice's mean strain noise, 1/m."""

    smoothing_time: float
    longest_smoothing_time: float
    memory_time: float
    threshold: float
    influence: float
    rate_floor: float
    growth_rate: float
    settling_time: float
    mean_noise: float


SETTINGS = len(StrainRateSettings._fields)


@compiled
def surface_strains(inverse_jacobian: FloatArray, displacement: FloatArray, normal: FloatArray) -> FloatArray:
    """Green–Lagrange strain xx, yy, xy [3, n, m], corrected for inclination, as ``reference.surface_strain``."""
    n, m, _ = displacement.shape
    strain = np.empty((3, n, m))
    for i in range(n):
        for j in range(m):
            ux, uy, _, vx, vy, _ = steps_at(displacement, i, j)
            ix, iy = inverse_jacobian[0, 0, i, j], inverse_jacobian[0, 1, i, j]
            jx, jy = inverse_jacobian[1, 0, i, j], inverse_jacobian[1, 1, i, j]
            xx, xy, yx, yy = ux * ix + vx * jx, ux * iy + vx * jy, uy * ix + vy * jx, uy * iy + vy * jy
            factor = 1.0 / max(normal[i, j, 2], _LEAST_NORMAL)
            strain[0, i, j] = factor * (xx + 0.5 * (xx * xx + yx * yx))
            strain[1, i, j] = factor * (yy + 0.5 * (xy * xy + yy * yy))
            strain[2, i, j] = factor * 0.5 * (xy + yx + xx * xy + yx * yy)
    return strain


@compiled
def step_strain_rate(
    sensor: DetectorSetup,
    displacement: FloatArray,
    surface: Surface,
    interval: float,
    elements: FloatArray,
    after: FloatArray,
    decision: Decision,
) -> None:
    """Fill the last two: the memory of the ``elements`` [11, n, m] after the step, and the decision."""
    chosen, noise = StrainRateSettings(*unpack(sensor.settings, SETTINGS)), surface.noise[0]
    strain = surface_strains(sensor.inverse_jacobian, displacement, surface.normal)
    if math.isnan(noise):  # a rate that may be noise alone would live on in the low-pass
        after[:] = elements
        after[XX : XY + 1] = strain
    else:
        low_pass = smoothing_weight(noise * chosen.mean_noise, interval, chosen)
        gain = low_pass / interval * math.sqrt(2.0 / (2.0 - low_pass))
        floor = np.maximum(chosen.rate_floor, noise * gain * elements[NOISE])
        flat = strain.reshape((3, floor.size)), surface.stays.reshape(floor.size), floor.reshape(floor.size)
        old, new = elements.reshape((ROWS, floor.size)), after.reshape((ROWS, floor.size))
        step_elements(old, *flat, interval, low_pass, chosen, new)
        after[NOISE] = elements[NOISE]
    decision.probability[:] = after[SLIP]
    decision.slip[:] = after[SLIP] > 0.0


@compiled
def smoothing_weight(strain_noise: float, interval: float, chosen: StrainRateSettings) -> float:
    """Weight of the newest rate: exact for a first-order low-pass and a strain that moves in straight lines.

    As much low-pass as the noise calls for: its trace in the rate is about strain noise over time constant.
    """
    longest = max(chosen.longest_smoothing_time, chosen.smoothing_time)
    time_constant = min(max(strain_noise / chosen.rate_floor, chosen.smoothing_time), longest)
    return -math.expm1(-interval / time_constant) if time_constant > 0.0 else 1.0


@compiled
def step_elements(
    old: FloatArray,
    strain: FloatArray,
    stays: BoolArray,
    floor: FloatArray,
    interval: float,
    low_pass: float,
    chosen: StrainRateSettings,
    new: FloatArray,
) -> None:
    """A positive extreme of the signed rate begins slip, a negative one ends it; in between the state holds.

    The rate ‖Ė‖_F sign(E:Ė) is compared with its exponentially forgetting mean and deviation, with a ``floor`` under
    the latter; an extreme value is learnt from with its influence only, and each touch starts anew.
    Written without branches, which would make it three times as slow.
    """
    forgotten = -math.expm1(-interval / chosen.memory_time)
    for e in range(old.shape[1]):
        xx, yy, xy = strain[0, e], strain[1, e], strain[2, e]
        a, b, c = old[RATE_XX, e], old[RATE_YY, e], old[RATE_XY, e]
        a += low_pass * ((xx - old[XX, e]) / interval - a)
        b += low_pass * ((yy - old[YY, e]) / interval - b)
        c += low_pass * ((xy - old[XY, e]) / interval - c)
        age = old[AGE, e] + interval if stays[e] else 0.0
        settled = 1.0 if age > chosen.settling_time else 0.0
        power = xx * a + yy * b + 2.0 * xy * c
        sign = settled * ((1.0 if power > 0.0 else 0.0) - (1.0 if power < 0.0 else 0.0))
        signal = sign * math.sqrt(a * a + b * b + 2.0 * c * c)
        mean, variance = settled * old[MEAN, e], settled * old[VARIANCE, e]
        surprise, least = signal - mean, chosen.threshold * floor[e]
        extreme = surprise * surprise > max(chosen.threshold**2 * variance, least * least)
        size = math.sqrt(xx * xx + yy * yy + 2.0 * xy * xy)
        onset = extreme and surprise > 0.0 and signal > max(least, chosen.growth_rate * size)
        end = extreme and surprise < 0.0 and signal < -least
        surprise *= chosen.influence if extreme else 1.0
        new[XX, e], new[YY, e], new[XY, e] = xx, yy, xy
        new[RATE_XX, e], new[RATE_YY, e], new[RATE_XY, e] = a, b, c
        new[MEAN, e] = mean + forgotten * surprise
        new[VARIANCE, e] = (1.0 - forgotten) * (variance + forgotten * surprise * surprise)
        new[AGE, e] = age
        new[SLIP, e] = 1.0 if settled > 0.0 and (old[SLIP, e] > 0.0 or onset) and not end else 0.0
