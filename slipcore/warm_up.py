"""Compile what a first frame would otherwise wait for."""

import time

import numpy as np

from slipcore.detector import SlipDetector


def warm_up() -> float:
    """Compile the kernels, or load them from the cache beside the package; seconds that it took."""
    began = time.perf_counter()
    axis = 1e-3 * np.arange(3.0)
    position = np.stack([*np.meshgrid(axis, axis, indexing="ij"), np.zeros((3, 3))], axis=-1)
    force = np.broadcast_to([0.0, 0.0, -0.1], position.shape)
    detector = SlipDetector(position, 1e-6, "filter")
    for frame in range(3):
        detector.step(float(frame), np.full(position.shape, 1e-6 * frame), force, np.zeros(3))
    return time.perf_counter() - began
