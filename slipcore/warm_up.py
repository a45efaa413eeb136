"""Compile what a first log would otherwise wait for."""

import time

import numpy as np

from slipcore.defaults import PATCHES
from slipcore.frames import FloatArray, GraspLog


def warm_up(*methods: str) -> float:
    """Compile the kernels that logs need by these detection methods, by any if none is named, or load what is kept.

    Seconds that it took.
    """
    began = time.perf_counter()
    warm_up_detectors(*methods)
    warm_up_samples()
    return time.perf_counter() - began


def warm_up_detectors(*methods: str) -> None:
    """What a first frame waits for: the kernels of these methods, of all if none is named."""
    from slipcore.detection.batch import detect_slip
    from slipcore.detection.methods import METHODS

    position = _position()
    force = np.broadcast_to([0.0, 0.0, -0.1], (PATCHES.least_frames, *position.shape))
    log = GraspLog(np.linspace(0.0, 0.3, len(force)), position, np.zeros(force.shape), element_area=1e-6, force=force)
    for method in methods or METHODS:
        detect_slip(log, method, lookahead=1)
        warm_up_step(method)


def warm_up_step(method: str) -> None:
    """What the first frame of a stream waits for."""
    from slipcore.detection.detector import SlipDetector

    position = _position()
    normal, force = (np.broadcast_to([0.0, 0.0, z], position.shape) for z in (1.0, -0.1))
    SlipDetector(position, 1e-6, method).step(0.0, np.zeros(position.shape), force, normal=normal)


def _position() -> FloatArray:
    """Of markers on a small lattice, m."""
    axis = 1e-3 * np.arange(3.0)
    return np.stack([*np.meshgrid(axis, axis, indexing="ij"), np.zeros((3, 3))], axis=-1)


def warm_up_samples() -> None:
    """What a whole log waits for beside its method: patches and samples, of which another process can take care."""
    from slipcore.collection import collect_samples
    from slipcore.contact import tangential_ramp
    from slipcore.detection.batch import detect_slip

    log = tangential_ramp(points=8, pitch=1.5e-3)
    collect_samples(log, detect_slip(log, "rigid_fit"))
