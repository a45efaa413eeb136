"""When the load on a patch stands on the limit surface: the object goes on moving, and the load grows no more."""

from typing import NamedTuple

import numpy as np

from slipcore.compilation import compiled
from slipcore.defaults import PATCHES, PatchOptions
from slipcore.frames import BoolArray, FloatArray
from slipcore.patch.motion import PatchMotion
from slipcore.patch.spans import IntArray, for_kernels


class SteadySliding(NamedTuple):
    """Frames [k] in which patches pivot, and in which they slide, under a load that grows no more."""

    pivoting: BoolArray
    sliding: BoolArray

    @property
    def any(self) -> BoolArray:
        """Either of them, [k]."""
        return self.pivoting | self.sliding


class Flatness(NamedTuple):
    """When a load counts as at its limit, see ``PatchOptions``."""

    flatness: float
    plateau_travel: float
    shortfall: float


def find_plateaus(
    time: FloatArray,
    bounds: IntArray,
    motion: PatchMotion,
    ratio: FloatArray,
    force: FloatArray,
    held: BoolArray,
    pitch: float,
    options: PatchOptions,
) -> SteadySliding:
    """Of patches with this ``motion`` under loads of this ``ratio`` [k] and tangential ``force`` [k, 2] N, one patch
    from each of the ``bounds`` up to the next.

    Spin about the normal cannot come from rolling. A patch that travels slides if the force goes along with it, is more
    than rolling resists, and is at its limit most of the way: what rolls travels under any load. Only frames that are
    ``held`` [k] and of which the ratio is known count.
    """
    held = held & np.isfinite(ratio)
    speed = np.nan_to_num(np.hypot(*motion.velocity.T))
    along = np.vecdot(force, motion.velocity) > PATCHES.aligned * np.hypot(*force.T) * speed
    pivots = held & motion.turns & (np.abs(motion.turning) > PATCHES.least_spin * speed)
    slides = held & motion.travels & ~pivots & along & (ratio > options.rolling_resistance)
    most = np.maximum.reduceat(np.where(held, ratio, 0.0), bounds[:-1])
    flatness = Flatness(options.flatness, options.plateau_travel, options.shortfall)
    pivoting, sliding, ratio = np.zeros(len(time), bool), np.zeros(len(time), bool), for_kernels(ratio)
    for moving, found in ((pivots, pivoting), (slides, sliding)):
        _mark_plateaus(time, motion.speed / pitch, ratio, moving, bounds, most, flatness, found)
    way = speed * _intervals(time, bounds) * motion.travels
    on_plateaus, whole = (np.add.reduceat(each, bounds[:-1]) for each in (np.where(sliding, way, 0.0), way))
    slides_on = np.repeat(on_plateaus >= options.sliding_share * whole, np.diff(bounds))
    return SteadySliding(pivoting, sliding & slides_on)


def _intervals(time: FloatArray, bounds: IntArray) -> FloatArray:
    """Mean of the intervals before and after each frame [k] of a patch."""
    first, last = bounds[:-1], bounds[1:] - 1
    interval = np.gradient(time)
    interval[first], interval[last] = time[first + 1] - time[first], time[last] - time[last - 1]
    return interval


@compiled
def _mark_plateaus(
    time: FloatArray,
    pitches: FloatArray,
    ratio: FloatArray,
    moving: BoolArray,
    bounds: IntArray,
    most: FloatArray,
    flatness: Flatness,
    found: BoolArray,
) -> None:
    """Of each run of frames in motion those near its largest load, if the object travels far enough in them.

    ``pitches`` [k] 1/s: its speed in elements.
    """
    for p in range(len(most)):
        begin, end = _next_run(moving, bounds[p], bounds[p + 1])
        while begin < end:
            peak = ratio[begin:end].max()
            if peak > 0.0 and peak >= (1.0 - flatness.shortfall) * most[p]:
                top = ratio[begin:end] >= (1.0 - flatness.flatness) * peak
                _mark_flat_parts(time[begin:end], pitches[begin:end], ratio[begin:end], top, flatness, found[begin:end])
            begin, end = _next_run(moving, end, bounds[p + 1])


@compiled
def _mark_flat_parts(
    time: FloatArray, pitches: FloatArray, ratio: FloatArray, top: BoolArray, flatness: Flatness, found: BoolArray
) -> None:
    begin, end = _next_run(top, 0, len(top))
    while begin < end:
        travel = _travel(time[begin:end], pitches[begin:end])
        if travel[-1] >= flatness.plateau_travel and _is_flat(travel, ratio[begin:end], flatness.flatness):
            found[begin:end] = True
        begin, end = _next_run(top, end, len(top))


@compiled
def _is_flat(travel: FloatArray, ratio: FloatArray, flatness: float) -> bool:
    """Whether the load grows by no more than the ``flatness`` of itself within an element's travel."""
    x, y = travel - travel.mean(), ratio - ratio.mean()
    return bool((x * y).sum() <= flatness * ratio.mean() * (x * x).sum())


@compiled
def _travel(time: FloatArray, speed: FloatArray) -> FloatArray:
    """Way [k] since the first frame."""
    way = np.zeros(len(time))
    for e in range(1, len(time)):
        way[e] = way[e - 1] + 0.5 * (speed[e] + speed[e - 1]) * (time[e] - time[e - 1])
    return way


@compiled
def _next_run(chosen: BoolArray, begin: int, end: int) -> tuple[int, int]:
    """First of the next frames that are all chosen, and the one after their last; both ``end`` if there are none."""
    while begin < end and not chosen[begin]:
        begin += 1
    after = begin
    while after < end and chosen[after]:
        after += 1
    return begin, after
