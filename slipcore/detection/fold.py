"""The steps of a compiled method over all frames of a log in one call: nothing comes from outside for a frame."""

from collections.abc import Callable
from inspect import unwrap
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from slipcore.compilation import address_of, borrowed, call_at, compiled
from slipcore.detection.filter.backward_pass import step_back
from slipcore.detection.filter.run import run_filter
from slipcore.detection.filter.state import EXPECTED, PROBABILITY
from slipcore.detection.filter.step import decide
from slipcore.detection.filter.tuning import LEAST_TRANSITION, THRESHOLD
from slipcore.detection.shared.decision import apply_decision
from slipcore.detection.shared.records import Memory, Plain, named
from slipcore.frames import BoolArray, FloatArray


class LogArrays(NamedTuple):
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
    step: int,
    sensor: Plain,
    log: LogArrays,
    rings: Rings,
    lookahead: int,
    room: Plain,
    results: FrameResults,
) -> float:
    """Fill ``results`` from the second frame on, by the ``step`` of a method, of which this is ``address_of_step``;
    marker noise at the end, m.

    ``rings`` hold the memory after the first frame. With a ``lookahead`` each frame is decided in the light of that
    many after it, for which the filter alone remembers enough. ``sensor`` and ``room`` are a ``DetectorSetup`` and
    a ``Workspace`` as plain tuples, as a detector's step hands them to its kernel, which is compiled once for both.
    """
    sensor, log, rings, room, results = borrowed((sensor, log, rings, room, results))
    frames, sigma = len(log.time), np.nan
    for k in range(1, frames):
        last, frame = frame_at(log, k - 1), frame_at(log, k)
        before, after = memory_at(results, rings, k - 1), memory_at(results, rings, k)
        given = sensor, last, frame, before, after, room, results.velocity[k]
        sigma, results.touching[k], results.slipping[k] = call_at(step, run_filter, given)
        if 0 < lookahead < k:
            revise(sensor, log, rings, k - lookahead, k, room, results)
    if lookahead > 0:
        for k in range(max(frames - lookahead, 1), frames):
            revise(sensor, log, rings, k, frames - 1, room, results)
    return sigma


def address_of_step(
    run: Callable[..., Any], sensor: Plain, log: LogArrays, rings: Rings, room: Plain, results: FrameResults
) -> int:
    """Where a method's compiled step is, which ``fold`` calls: together with that it would be compiled twice."""
    frame, memory = unwrap(frame_at)(log, 0), unwrap(memory_at)(results, rings, 0)
    return address_of(run, sensor, frame, frame, memory, memory, room, results.velocity[0])


def rings_from(start: Memory, lookahead: int) -> Rings:
    """What is remembered of the first frame, with room for as many as are looked back at."""
    return Rings(_ring(2, start.noise), _ring(max(lookahead + 1, 2), start.elements), _ring(2, start.common))


def _ring(size: int, first: FloatArray) -> FloatArray:
    ring = np.empty((size, *first.shape))
    ring[0] = first
    return ring


@compiled
def frame_at(log: LogArrays, k: int) -> Plain:
    """One frame of a log: what ``FrameArrays`` has, as a plain tuple."""
    return log.time[k], log.displacement[k], log.force[k], log.object_pose[k], log.normal[k], log.contact[k]


@compiled
def memory_at(results: FrameResults, rings: Rings, k: int) -> Plain:
    """What a ``Memory`` has of one frame, or will have, as a plain tuple; what is found goes straight to its place."""
    noise, common = rings.noise[k % 2], rings.common[k % 2]
    elements = rings.elements[k % len(rings.elements)]
    return results.contact[k], results.slip[k], results.probability[k], noise, elements, common


@compiled(inline=True)
def revise(
    given: Plain,
    log: LogArrays,
    rings: Rings,
    k: int,
    last: int,
    working: Plain,
    results: FrameResults,
) -> None:
    """Decide frame ``k`` again, in the light of what the filter remembers up to frame ``last``."""
    frames = frame_at(log, k - 1), frame_at(log, k)
    memories = memory_at(results, rings, k - 1), memory_at(results, rings, k)
    sensor, earlier, frame, before, after, room = named(given, *frames, *memories, working)
    elements, posterior = rings.elements, room.weight  # free until the decision is applied
    kept, least = len(elements), sensor.settings[LEAST_TRANSITION]
    posterior[:] = elements[last % kept, PROBABILITY]
    for i in range(last - 1, k - 1, -1):
        step_back(elements[i % kept], elements[(i + 1) % kept], posterior, least, posterior)
    decide(posterior, elements[k % kept, EXPECTED], sensor.settings[THRESHOLD], room.decision)
    results.touching[k], results.slipping[k] = apply_decision(
        sensor.position, earlier, frame, room.decision, before, after, room.weight, results.velocity[k]
    )
