"""How the load on the contact changes, and whether its growth makes everything stick again."""

import math
from typing import NamedTuple

from slipcore.compilation import compiled, unpack
from slipcore.defaults import NUMERICS
from slipcore.detection.filter.pose import AnchorMotion, Anchors
from slipcore.detection.filter.state import FRICTION, LOADING
from slipcore.detection.filter.tuning import Tuning
from slipcore.frames import FloatArray

_LEAST_LEVER = NUMERICS.least_lever


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


@compiled(fastmath={"reassoc"})
def step_loading(
    loading: Loading,
    places: tuple[FloatArray, FloatArray],
    motion: AnchorMotion,
    deeper: FloatArray,
    force: FloatArray,
    interval: float,
    gain: float,
) -> Loading:
    """Rates of the load on the elements [k] in contact now and before, at x, y m, the object moved under each by
    x, y m, each ``deeper`` by m, and by change of ``force`` [3, k or more] N (empty if there is none).
    """
    x, y = places
    count = len(x)
    if count == 0:
        return Loading(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    cx = cy = depth = 0.0
    for e in range(count):
        cx, cy, depth = cx + x[e], cy + y[e], depth + deeper[e]
    cx, cy, depth = cx / count, cy / count, depth / count
    moved = lever = moment = force_x = force_y = normal = 0.0
    for e in range(count):
        moved += motion.x[e] ** 2 + motion.y[e] ** 2
        lever += (x[e] - cx) ** 2 + (y[e] - cy) ** 2
    if force.size:
        for e in range(count):
            force_x, force_y, normal = force_x + force[0, e], force_y + force[1, e], normal - force[2, e]
            moment += (x[e] - cx) * force[1, e] - (y[e] - cy) * force[0, e]
    twist = moment / max(math.sqrt(lever / count), _LEAST_LEVER)
    return Loading(
        loading.depth + gain * (depth / interval - loading.depth),
        loading.motion + gain * (math.sqrt(moved / count) / interval - loading.motion),
        loading.normal + gain * (normal / interval - loading.normal),
        loading.force_x + gain * (force_x / interval - loading.force_x),
        loading.force_y + gain * (force_y / interval - loading.force_y),
        loading.twist + gain * (twist / interval - loading.twist),
    )


@compiled(inline=True)
def restick_under_load(
    before: FloatArray,
    after: FloatArray,
    anchors: Anchors,
    motion: AnchorMotion,
    indentation: FloatArray,
    force: FloatArray,
    noise: tuple[float, float, float],
    tuning: Tuning,
) -> bool:
    """Whether everything sticks again because the normal load grows (Mindlin and Deresiewicz, J. Appl. Mech. 20 (1953)
    327); the loading goes from the filter's common state ``before`` to ``after``.

    Changes since the last frame: of ``indentation`` [k] m and of ``force`` [3, k] N, empty without forces. ``noise``:
    interval s, variance of a marker coordinate m², and deviation of an element's normal force N.
    """
    interval, variance, force_noise = noise
    gain = low_pass(interval, tuning.loading_smoothing)
    loading = Loading(*unpack(before[LOADING : LOADING + 6], 6))
    places = anchors.marker_x, anchors.marker_y
    loading = step_loading(loading, places, motion, indentation, force, interval, gain)
    for value in range(6):
        after[LOADING + value] = loading[value]
    count = len(indentation)
    if count == 0:
        return False
    if force.size == 0:
        return restick_by_depth(loading, count, variance, interval, gain, tuning)
    friction = before[FRICTION] / before[FRICTION + 1] if before[FRICTION + 1] > 0.0 else 0.0
    slope = tuning.pressing_share * friction if friction > 0.0 else tuning.pressing_slope
    return restick_by_force(loading, math.sqrt(2.0 * count) * force_noise, interval, gain, slope, tuning)


@compiled
def restick_by_force(
    loading: Loading, noise: float, interval: float, gain: float, slope: float, tuning: Tuning
) -> bool:
    """Whether the normal force grows so much faster than the tangential one that all elements stick again.

    ``noise`` of a change of the resultant, N; ``slope``: least growth of F_T for that of F_N that can slip.
    """
    rate = noise / interval * math.sqrt(gain / (2.0 - gain)) * gain + tuning.pressing_force_floor
    sideways = math.sqrt(loading.force_x**2 + loading.force_y**2 + loading.twist**2)
    return loading.normal > tuning.pressing_force_deviations * rate and sideways < slope * loading.normal


@compiled
def restick_by_depth(
    loading: Loading, count: int, variance: float, interval: float, gain: float, tuning: Tuning
) -> bool:
    """The same from the indentation and motion of ``count`` elements, by the stiffness of a stuck contact."""
    noise = math.sqrt(2.0 * variance / count) / interval * gain + tuning.pressing_floor
    sideways = tuning.stiffness_ratio * loading.motion
    return loading.depth > tuning.pressing_deviations * noise and sideways < tuning.pressing_slope * loading.depth
