"""A filter of two states an element, stick and slip, on its place in the object's frame and its force ratio."""

import numpy as np

from slipcore.defaults import FilterOptions
from slipcore.kernels.filter import BODY, ROWS, STICK_VARIANCE, Tuning
from slipcore.kernels.run import run_filter
from slipcore.methods.interface import CompiledMethod, Start
from slipcore.strain import Lattice


def start(lattice: Lattice, options: FilterOptions) -> Start:
    """Nothing touches yet."""
    elements = np.zeros((ROWS, *lattice.position.shape[:2]))
    elements[STICK_VARIANCE] = np.inf
    body = np.zeros(BODY)
    body[3] = 1.0
    return Start(np.array([getattr(options, name) for name in Tuning._fields], float), elements, body)


METHOD = CompiledMethod(FilterOptions, start, run_filter)
