"""The steps of a compiled method over all frames of a log in one call: nothing comes from outside for a frame."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slipcore.compilation import compiled
from slipcore.detection.filter.run import run_filter
from slipcore.detection.filter.smoothing import look_back
from slipcore.detection.filter.state import PROBABILITY
from slipcore.detection.filter.step import decide
from slipcore.detection.filter.tuning import LEAST_TRANSITION, THRESHOLD
from slipcore.detection.shared.decision import apply_decision
from slipcore.detection.shared.records import Decision, FrameArrays, Memory, Sensor
from slipcore.detection.strain_rate.run import run_strain_rate
from slipcore.frames import BoolArray, FloatArray


class Recording(NamedTuple):
    """The frames of a log, [t, ...]; each frame of a field that it does not have is empty."""

    time: FloatArray
    displacement: FloatArray
    force: FloatArray
    object_pose: FloatArray
    normal: FloatArray
    contact: BoolArray


class FrameResults(NamedTuple):
    """What is found in each frame: fields [t, n, m] and [t, n, m, 2], and how many elements touch and slip, [t]."""

    contact: BoolArray
    slip: BoolArray
    probability: FloatArray
    velocity: FloatArray
    touching: NDArray[np.int64]
    slipping: NDArray[np.int64]


class Rings(NamedTuple):
    """What is remembered of the last frames, in turn: [2 or more, ...] of each array of a ``Memory``."""

    noise: FloatArray
    elements: FloatArray
    common: FloatArray


@compiled
def fold(
    is_filter: bool, sensor: Sensor, log: Recording, start: Memory, lookahead: int, results: FrameResults
) -> float:
    """Fill ``results`` from the second frame on, by method "filter" or else "strain_rate"; marker noise at the end, m.

    ``start`` is the memory after the first frame. With a ``lookahead`` each frame is decided in the light of that many
    after it, for which the filter alone remembers enough.
    """
    frames, sigma = len(log.time), np.nan
    rings = Rings(
        ring_buffer(2, start.noise), ring_buffer(max(lookahead + 1, 2), start.elements), ring_buffer(2, start.common)
    )
    for k in range(1, frames):
        last, frame = frame_at(log, k - 1), frame_at(log, k)
        before, after = memory_at(results, rings, k - 1), memory_at(results, rings, k)
        given = sensor, last, frame, before, after
        step = run_filter(*given, results.velocity[k]) if is_filter else run_strain_rate(*given, results.velocity[k])
        sigma, results.touching[k], results.slipping[k] = step
        if 0 < lookahead < k:
            revise(sensor, log, rings, k - lookahead, k, results)
    if lookahead > 0:
        for k in range(max(frames - lookahead, 1), frames):
            revise(sensor, log, rings, k, frames - 1, results)
    return sigma


@compiled
def ring_buffer(size: int, first: FloatArray) -> FloatArray:
    """An array for as many frames, with the first one in it."""
    ring = np.empty((size, *first.shape))
    ring[0] = first
    return ring


@compiled
def frame_at(log: Recording, k: int) -> FrameArrays:
    """One frame of a log."""
    return FrameArrays(
        log.time[k], log.displacement[k], log.force[k], log.object_pose[k], log.normal[k], log.contact[k]
    )


@compiled
def memory_at(results: FrameResults, rings: Rings, k: int) -> Memory:
    """What is remembered of one frame, or will be; what is found goes straight to its place."""
    noise, common = rings.noise[k % 2], rings.common[k % 2]
    elements = rings.elements[k % len(rings.elements)]
    return Memory(results.contact[k], results.slip[k], results.probability[k], noise, elements, common)


@compiled
def revise(sensor: Sensor, log: Recording, rings: Rings, k: int, last: int, results: FrameResults) -> None:
    """Decide frame ``k`` again, in the light of what the filter remembers up to frame ``last``."""
    elements, shape = rings.elements, results.contact[k].shape
    kept, least = len(elements), sensor.settings[LEAST_TRANSITION]
    posterior, earlier = elements[last % kept, PROBABILITY].copy(), np.empty(shape)
    for i in range(last - 1, k - 1, -1):
        look_back(elements[i % kept], elements[(i + 1) % kept], posterior, least, earlier)
        posterior, earlier = earlier, posterior
    decision = Decision(np.empty(shape, np.bool_), np.empty(shape))
    decide(posterior, sensor.settings[THRESHOLD], decision)
    before, after = memory_at(results, rings, k - 1), memory_at(results, rings, k)
    stays, frames = after.contact & before.contact, (frame_at(log, k - 1), frame_at(log, k))
    results.touching[k], results.slipping[k] = apply_decision(
        sensor.position, *frames, stays, decision, before, after, results.velocity[k]
    )
