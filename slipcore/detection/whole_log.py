"""Whole logs by a compiled method: the first frame by ``step``, all others in one call."""

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from slipcore.detection.detector import DetectorState, step
from slipcore.detection.fold import FrameResults, LogArrays, address_of_step, fold, rings_from
from slipcore.detection.methods import find_method, findings_by
from slipcore.detection.shared.interface import CompiledMethod
from slipcore.detection.shared.records import NO_FIELD, NO_MASK, NO_POSE, shared_workspace
from slipcore.detection.sharpening import sharpened
from slipcore.frames import BoolArray, FloatArray, GraspLog
from slipcore.gross_slip import find_gross_slip
from slipcore.slip_state import SlipHistory, slip_events


def history_of(log: GraspLog, state: DetectorState, lookahead: int) -> SlipHistory:
    """What a compiled method finds in a log, from its ``state`` before it; as frame by frame to the last bit."""
    setup, results = state.setup, _empty_results(log)
    state, first = step(state, next(log.frames()))
    memory = state.memory
    results.contact[0], results.slip[0], results.velocity[0] = memory.contact, memory.slip, first.velocity
    results.probability[0] = memory.probability
    results.touching[0], results.slipping[0] = memory.contact.sum(), memory.slip.sum()
    method = find_method(setup.method)
    assert isinstance(method, CompiledMethod)
    ahead = lookahead if method.revise else 0
    room = shared_workspace(*memory.probability.shape)
    rings = rings_from(memory, ahead)
    displacement, force = sharpened(log.displacement, log.force, setup.options, setup.element_area)
    recording = _recording(log, displacement, force)
    sensor = tuple(setup.sensor)
    address = address_of_step(method.run, sensor, recording, rings, room, results)
    noise = fold(address, sensor, recording, rings, ahead, room, results)
    found = findings_by(setup.method, rings.common[(len(log) - 1) % 2], noise)
    return replace(_history(log, setup.method, noise, results), findings=found)


def _empty_results(log: GraspLog) -> FrameResults:
    shape = log.displacement.shape[:3]
    counts = np.empty(len(log), np.int64), np.empty(len(log), np.int64)
    return FrameResults(np.empty(shape, bool), np.empty(shape, bool), np.empty(shape), np.empty((*shape, 2)), *counts)


def _recording(log: GraspLog, displacement: FloatArray, force: FloatArray | None) -> LogArrays:
    return LogArrays(
        log.time,
        _frames(displacement, NO_FIELD, log),
        _frames(force, NO_FIELD, log),
        _frames(log.object_pose, NO_POSE, log),
        _frames(log.normal, NO_FIELD, log),
        _frames(log.contact, NO_MASK, log),
    )


def _frames(field: NDArray[Any] | None, none: NDArray[Any], log: GraspLog) -> NDArray[Any]:
    """The field, or ``none`` of it in each frame; not to be written to, so that the kernels see one type."""
    given = np.empty((len(log), *none.shape), none.dtype) if field is None else field
    frames = np.ascontiguousarray(given).view()
    frames.flags.writeable = False
    return frames


def _history(log: GraspLog, method: str, noise: float, results: FrameResults) -> SlipHistory:
    contact, slip, probability, velocity, touching, slipping = results
    if log.observed is not None:
        contact, slip, probability, velocity = _masked(log.observed, results)
        touching, slipping = (np.count_nonzero(field, axis=(1, 2)) for field in (contact, slip))
    ratio = np.full(len(log), np.nan)
    np.divide(slipping, touching, out=ratio, where=touching > 0)
    events = slip_events(log.time, contact, slip, log.observed)
    fields = contact, slip, probability, 1.0 - ratio, velocity, find_gross_slip(contact, slip)
    return SlipHistory(log.time, *fields, events, noise, method, log.observed)


def _masked(observed: BoolArray, results: FrameResults) -> tuple[BoolArray, BoolArray, FloatArray, FloatArray]:
    """As ``SlipState.masked`` of each frame: what was not observed, and no velocity unless it was so before."""
    throughout = observed.copy()
    throughout[1:] &= observed[:-1]
    velocity = np.where(throughout[..., None], results.velocity, np.nan)
    contact, slip = results.contact & observed, results.slip & observed
    return contact, slip, np.where(observed, results.probability, 0.0), velocity
