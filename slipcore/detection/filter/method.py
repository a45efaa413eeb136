"""A filter of two states an element, stick and slip, on its place in the object's frame and its force ratio."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from slipcore.defaults import NOISE, FilterOptions
from slipcore.detection.filter.backward_pass import step_back
from slipcore.detection.filter.run import run_filter
from slipcore.detection.filter.state import (
    COMMON,
    DOUBTED_FRAMES,
    EXPECTED,
    FORCE_FRAMES,
    LASTING,
    POSE,
    PROBABILITY,
    REFERENCE,
    RESOLUTION,
    ROWS,
    STICK_VARIANCE,
)
from slipcore.detection.filter.step import decide
from slipcore.detection.filter.tuning import LEAST_TRANSITION, THRESHOLD, settings_of
from slipcore.detection.shared.interface import CompiledMethod, Start
from slipcore.detection.shared.records import Decision
from slipcore.finding import Finding
from slipcore.frames import FloatArray
from slipcore.surface.strain import Lattice


def start(lattice: Lattice, options: FilterOptions) -> Start:
    """Nothing touches yet."""
    elements, common = np.zeros((ROWS, *lattice.position.shape[:2])), np.zeros(COMMON)
    elements[STICK_VARIANCE] = np.inf
    common[POSE + 3] = common[REFERENCE + 3] = 1.0  # not stretched
    return Start(settings_of(options), elements, common)


def revise(elements: Sequence[FloatArray], settings: FloatArray) -> Decision:
    """The decision on the first of these frames in the light of those after it."""
    posterior, least = elements[-1][PROBABILITY], settings[LEAST_TRANSITION]
    for before, after in reversed(list(pairwise(elements))):
        known, posterior = posterior, np.empty(posterior.shape)
        step_back(before, after, known, least, posterior)
    decision = Decision(np.empty(posterior.shape, bool), np.empty(posterior.shape))
    decide(posterior, elements[0][EXPECTED], settings[THRESHOLD], decision)
    return decision


def findings(common: FloatArray, noise: float) -> tuple[Finding, ...]:
    """Forces that are not believed, and noise of markers that three frames do not show.

    Rounding by less than the ``noise`` of a marker's coordinate (m, NaN: unknown) hides nothing, and is not reported.
    """
    found, frames, doubted = [], round(common[FORCE_FRAMES]), round(common[DOUBTED_FRAMES])
    if doubted:
        evidence = (
            f"the object pulls, or forces stand still while markers move, in {doubted} of {frames} frames in which it "
            "touches; slip is found without them there"
        )
        remedy = "give the force of the object on the sensor, in its frame, as it is at the frame's time"
        found.append(Finding("forces not believed", evidence, remedy))
    step = common[RESOLUTION]
    if step > 0.0 and not step <= noise:
        evidence = f"all places of markers are multiples of {1e6 * step:.3g} µm"
        found.append(Finding("rounded", evidence, "record places as finely as the tracker gives them"))
    elif step == 0.0 and common[LASTING] > NOISE.lasting_told:
        evidence = (
            f"markers part from their neighbours by {1e6 * common[LASTING]:.3g} µm that lasts from frame to frame"
        )
        found.append(Finding("lasting noise", evidence, "record without a low-pass; calibrate the sensor"))
    return tuple(found)


METHOD = CompiledMethod(FilterOptions, start, run_filter, revise, findings)
