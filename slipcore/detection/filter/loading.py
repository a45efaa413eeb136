"""How the load on the contact changes, and whether it presses everything home."""

import math
from typing import NamedTuple

from slipcore.compilation import compiled
from slipcore.frames import FloatArray

STIFFNESS = 0.67
"""Tangential over normal stiffness of a stuck contact, 2(1 − ν)/(2 − ν) at ν ≈ ½ (Mindlin)."""


class Loading(NamedTuple):
    """Low-passed rates of the load: depth m/s and root mean square motion m/s; F_N, F_x, F_y and M/lever N/s."""

    depth: float
    motion: float
    normal: float
    force_x: float
    force_y: float
    twist: float


@compiled
def low_pass(interval: float, time_constant: float) -> float:
    """Weight of the newest value; 1 for no time constant."""
    return -math.expm1(-interval / time_constant) if time_constant > 0.0 else 1.0


@compiled
def step_loading(
    loading: Loading,
    places: tuple[FloatArray, FloatArray],
    motion: tuple[FloatArray, FloatArray],
    deeper: FloatArray,
    force: FloatArray,
    interval: float,
    gain: float,
) -> Loading:
    """Rates of the load on the elements [k] in contact now and before, at x, y m, the object moved under each by
    x, y m, each ``deeper`` by m, and by change of ``force`` [3, k] N (empty if there is none).
    """
    x, y = places
    count = len(x)
    if count == 0:
        return Loading(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    cx, cy = x.mean(), y.mean()
    moved = moment = lever = 0.0
    for e in range(count):
        moved += motion[0][e] ** 2 + motion[1][e] ** 2
        lever += (x[e] - cx) ** 2 + (y[e] - cy) ** 2
        if force.size:
            moment += (x[e] - cx) * force[1, e] - (y[e] - cy) * force[0, e]
    force_x = force_y = normal = 0.0
    if force.size:
        force_x, force_y, normal = force[0].sum(), force[1].sum(), -force[2].sum()
    twist = moment / max(math.sqrt(lever / count), 1e-9)
    return Loading(
        loading.depth + gain * (deeper.mean() / interval - loading.depth),
        loading.motion + gain * (math.sqrt(moved / count) / interval - loading.motion),
        loading.normal + gain * (normal / interval - loading.normal),
        loading.force_x + gain * (force_x / interval - loading.force_x),
        loading.force_y + gain * (force_y / interval - loading.force_y),
        loading.twist + gain * (twist / interval - loading.twist),
    )


@compiled
def forces_press_home(loading: Loading, count: int, sigma: float, interval: float, gain: float, slope: float) -> bool:
    """Whether the normal force grows so much faster than the tangential one that all ``count`` elements stick again.

    ``sigma`` of an element's force, N; ``slope``: least growth of F_T for that of F_N that can slip.
    """
    noise = math.sqrt(2.0 * count) * sigma / interval * math.sqrt(gain / (2.0 - gain)) * gain + 1e-3
    sideways = loading.force_x**2 + loading.force_y**2 + loading.twist**2
    sideways = math.sqrt(max(0.0, sideways - 3.0 * noise * noise))
    return loading.normal > 4.0 * noise and sideways < slope * loading.normal


@compiled
def depth_presses_home(
    loading: Loading, count: int, variance: float, interval: float, gain: float, slope: float, floor: float
) -> bool:
    """The same from indentation and motion, by the stiffness of a stuck contact."""
    noise = math.sqrt(2.0 * variance / count) / interval * gain + floor
    return loading.depth > 3.0 * noise and STIFFNESS * loading.motion < slope * loading.depth
