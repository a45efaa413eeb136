"""When the load on a patch stands on the limit surface: the object goes on moving, and the load grows no more."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slipcore.defaults import PATCHES, PatchOptions
from slipcore.frames import BoolArray, FloatArray
from slipcore.patch.motion import Motion


class Plateaus(NamedTuple):
    """Frames [t] in which a patch pivots, and in which it slides, under a load that grows no more."""

    pivoting: BoolArray
    sliding: BoolArray

    @property
    def any(self) -> BoolArray:
        """Either of them, [t]."""
        return self.pivoting | self.sliding


def find_plateaus(
    time: FloatArray,
    motion: Motion,
    ratio: FloatArray,
    force: FloatArray,
    held: BoolArray,
    pitch: float,
    options: PatchOptions,
) -> Plateaus:
    """Of a patch with this ``motion`` under a load of this ``ratio`` [t] and tangential ``force`` [t, 2] N.

    Spin about the normal cannot come from rolling. A patch that travels slides if the force goes along with it, is more
    than rolling resists, and is at its limit most of the way: what rolls travels under any load. Only frames that are
    ``held`` [t] count.
    """
    speed = np.nan_to_num(np.hypot(*motion.velocity.T))
    along = np.vecdot(force, motion.velocity) > PATCHES.aligned * np.hypot(*force.T) * speed
    pivots = held & motion.turns & (np.abs(motion.turning) > PATCHES.least_spin * speed)
    slides = held & motion.travels & ~pivots & along & (ratio > options.rolling_resistance)
    most = float(ratio[held].max(initial=0.0))
    pitches = motion.speed / pitch
    pivoting, sliding = (_plateaus(time, pitches, ratio, moving, most, options) for moving in (pivots, slides))
    way = speed * np.gradient(time) * motion.travels
    rolls = way[sliding].sum() < options.sliding_share * way.sum()
    return Plateaus(pivoting, sliding & ~rolls)


def _plateaus(
    time: FloatArray, pitches: FloatArray, ratio: FloatArray, moving: BoolArray, most: float, options: PatchOptions
) -> BoolArray:
    """Of each run of frames in motion those near its largest load, if the object travels far enough in them."""
    found = np.zeros(len(time), bool)
    for run in runs(moving):
        peak = ratio[run].max()
        top = run[ratio[run] >= (1.0 - options.flatness) * peak]
        for part in runs_of(top):
            travel = _travel(time[part], pitches[part])
            far_enough = travel[-1] >= options.plateau_travel
            if far_enough and peak >= (1.0 - options.shortfall) * most and _is_flat(travel, ratio[part], options):
                found[part] = True
    return found


def _is_flat(travel: FloatArray, ratio: FloatArray, options: PatchOptions) -> bool:
    """Whether the load grows by no more than the ``flatness`` of itself within an element's travel."""
    slope = np.polyfit(travel, ratio, 1)[0]
    return bool(slope <= options.flatness * ratio.mean())


def _travel(time: FloatArray, speed: FloatArray) -> FloatArray:
    """Way [k] since the first frame."""
    steps = 0.5 * (speed[1:] + speed[:-1]) * np.diff(time)
    return np.concatenate([[0.0], np.cumsum(steps)])


def runs(chosen: BoolArray) -> list[NDArray[np.int64]]:
    """Indices of each stretch of frames that are all chosen."""
    return runs_of(np.flatnonzero(chosen))


def runs_of(frames: NDArray[np.int64]) -> list[NDArray[np.int64]]:
    """Ascending numbers of frames, divided where one is left out."""
    return np.split(frames, np.flatnonzero(np.diff(frames) > 1) + 1) if len(frames) else []
