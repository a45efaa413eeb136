"""For arrays of few elements that measure displacement and forces: methods ``forces_only`` and ``filter``, and layers.

An element that is not much smaller than the contact slips bit by bit: half of it slips while it still takes on load,
and its mean displacement parts from the object's motion long before. How elements share the load says more there, and
where several stick beside each other their markers show when one does not. How far slip reaches in under a load follows
from how the contact has grown (``layers``). Log-odds of all three are added.
"""

from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from scipy.special import expit

from slipcore.defaults import CoarseOptions, FilterOptions
from slipcore.detection.coarse.joining import Evidence, join
from slipcore.detection.coarse.layers import Layers, LayerTuning, no_layers
from slipcore.detection.filter import method as by_place
from slipcore.detection.filter.loading import low_pass
from slipcore.detection.filter.state import DOUBTED_FRAMES
from slipcore.detection.forces_only import method as by_force
from slipcore.detection.forces_only.step import ForcesState
from slipcore.detection.forces_only.tuning import considered
from slipcore.detection.shared.contact import ContactThreshold
from slipcore.detection.shared.interface import Method, ObservedFrame
from slipcore.detection.shared.lasting_noise import start_noise
from slipcore.detection.shared.records import (
    NO_FIELD,
    NO_MASK,
    NO_POSE,
    Decision,
    DetectorSetup,
    FrameArrays,
    Memory,
    empty_like,
    for_setup,
    read_only,
    shared_workspace,
    unwritten,
)
from slipcore.finding import Finding
from slipcore.surface.strain import Lattice


class CoarseState(NamedTuple):
    """What each method remembers, the contact's layers, and the last frame, as the filter sees it."""

    forces: ForcesState
    layers: Layers
    memory: Memory
    frame: FrameArrays


def init(lattice: Lattice, options: CoarseOptions) -> CoarseState:
    """Nothing touches yet."""
    shape, start = lattice.position.shape, by_place.METHOD.start(lattice, FilterOptions())
    noise = start_noise()
    nowhere, nothing = np.zeros(shape[:2], bool), np.zeros(shape[:2])
    frame = FrameArrays(-np.inf, read_only(np.zeros(shape)), NO_FIELD, NO_POSE, NO_FIELD, NO_MASK)
    memory = Memory(nowhere, nowhere, nothing, noise, start.elements, start.common)
    return CoarseState(by_force.init(lattice, options), no_layers(nothing.size, options), memory, frame)


def step(
    state: CoarseState, lattice: Lattice, seen: ObservedFrame, options: CoarseOptions
) -> tuple[CoarseState, Decision]:
    """All three, on the same contact; without forces to believe the filter's word alone."""
    forces, decision = by_force.step(state.forces, lattice, seen, options)
    last = unwritten(state.frame)
    frame = FrameArrays(
        0.0 if np.isinf(last.time) else last.time + seen.interval,
        read_only(seen.displacement),
        read_only(seen.force) if seen.force.size else NO_FIELD,
        read_only(seen.object_pose),
        read_only(seen.normal.copy()),
        read_only(seen.contact.copy()),
    )
    after = empty_like(state.memory)
    shape = seen.contact.shape
    velocity = np.empty((*shape, 2))
    arguments = *map(tuple, (_sensor(lattice, options), last, frame, state.memory, after)), shared_workspace(*shape)
    by_place.METHOD.run(*arguments, velocity)  # as in ``detector.step``, lest another kernel is compiled
    doubted = after.common[DOUBTED_FRAMES] > state.memory.common[DOUBTED_FRAMES]
    if doubted or not seen.force.size:
        least = expit(-options.largest_sum)
        probability = np.clip(after.probability, least, 1.0 - least)
        return CoarseState(forces, state.layers, after, frame), Decision(probability > 0.5, probability)
    layers, joined = Layers._make(map(np.empty_like, state.layers)), Decision._make(map(np.empty_like, decision))
    gain = low_pass(seen.interval, options.force_smoothing)
    evidence = Evidence(
        read_only(lattice.position),
        read_only(seen.displacement),
        frame.normal,
        frame.contact,
        seen.stays,
        forces.normal,
        forces.tangential,
        0.0 if np.isnan(seen.force_noise) else float(seen.force_noise * np.sqrt(gain / (2.0 - gain))),
        decision.probability,
        after.probability,
    )
    known = considered(options, LayerTuning._fields)
    plain: list[Any] = [tuple(part) for part in (evidence, state.layers, known, layers, joined)]
    join(*plain)  # numba is slow at named tuples from Python
    return CoarseState(forces, layers, after, frame), joined


@lru_cache(maxsize=16)
def _sensor(lattice: Lattice, options: CoarseOptions) -> DetectorSetup:
    """The lattice and options for the filter's kernel; contact is known, and only what pulls follows from them."""
    touch = np.array(ContactThreshold(0.0, 0.0, options.contact_noise, 1.0, 1.0, 0.0, 1.0, 0.0, 0.0))
    settings = by_place.METHOD.start(lattice, FilterOptions()).settings
    return DetectorSetup(*for_setup(lattice), touch, touch, settings)


def findings(state: CoarseState, noise: float) -> tuple[Finding, ...]:
    """What the filter found inconsistent."""
    return by_place.findings(state.memory.common, noise)


METHOD = Method(CoarseOptions, init, step, findings)
