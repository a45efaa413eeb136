"""Compile what a first frame would otherwise wait for."""

import time

import numpy as np

from slipcore.defaults import PATCHES
from slipcore.frames import GraspLog


def warm_up(*methods: str) -> float:
    """Compile the kernels of these detection methods, of all if none is named, or load them from where they are kept.

    Seconds that it took.
    """
    began = time.perf_counter()
    from slipcore.detection.batch import detect_slip
    from slipcore.detection.methods import METHODS

    axis = 1e-3 * np.arange(3.0)
    position = np.stack([*np.meshgrid(axis, axis, indexing="ij"), np.zeros((3, 3))], axis=-1)
    force = np.broadcast_to([0.0, 0.0, -0.1], (PATCHES.least_frames, *position.shape))
    log = GraspLog(np.linspace(0.0, 0.3, len(force)), position, np.zeros(force.shape), element_area=1e-6, force=force)
    for method in methods or METHODS:
        detect_slip(log, method, lookahead=1)
    return time.perf_counter() - began
