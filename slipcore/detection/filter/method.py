"""A filter of two states an element, stick and slip, on its place in the object's frame and its force ratio."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from slipcore.defaults import FilterOptions
from slipcore.detection.filter.run import run_filter
from slipcore.detection.filter.step import BODY, PROBABILITY, ROWS, STICK_VARIANCE, THRESHOLD, Tuning, decide, look_back
from slipcore.detection.shared.interface import CompiledMethod, Decision, Start
from slipcore.detection.shared.strain import Lattice
from slipcore.frames import FloatArray


def start(lattice: Lattice, options: FilterOptions) -> Start:
    """Nothing touches yet."""
    elements = np.zeros((ROWS, *lattice.position.shape[:2]))
    elements[STICK_VARIANCE] = np.inf
    body = np.zeros(BODY)
    body[3] = 1.0
    return Start(np.array([getattr(options, name) for name in Tuning._fields], float), elements, body)


def revise(own: Sequence[FloatArray], settings: FloatArray) -> Decision:
    """The decision on the first of these frames in the light of those after it."""
    posterior = own[-1][PROBABILITY]
    for before, after in reversed(list(pairwise(own))):
        known, posterior = posterior, np.empty(posterior.shape)
        look_back(before, after, known, posterior)
    slip, probability = np.empty(posterior.shape, bool), np.empty(posterior.shape)
    decide(posterior, settings[THRESHOLD], slip, probability)
    return Decision(slip, probability)


METHOD = CompiledMethod(FilterOptions, start, run_filter, revise)
