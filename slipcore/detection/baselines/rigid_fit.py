"""Deviation from rigid motion, after Dong et al. 2019 (the paper's [23]).

A rigid motion is fitted to the displacement of points that are taken to stick, and what deviates from it slips. That
work does not give the thresholds of its region filter; the paper "selected a similar proportion". Assumed here: the
points are those of the contact's core, a given share of it nearest to its centre, and the deviation is judged as a
share of the rigid motion. As the paper says, it fails once slip reaches the core.
"""

import numpy as np

from slipcore.defaults import RigidFitOptions
from slipcore.detection.baselines.since_touch import threshold_method
from slipcore.detection.shared.interface import ObservedFrame
from slipcore.detection.shared.rigid_motion import fit_rigid_motion
from slipcore.frames import BoolArray, FloatArray
from slipcore.surface.strain import Lattice


def measure(_: Lattice, seen: ObservedFrame) -> FloatArray:
    """Displacement in the plane [2, n, m] m."""
    return np.moveaxis(seen.displacement[..., :2], -1, 0)


def slips(lattice: Lattice, seen: ObservedFrame, change: FloatArray, options: RigidFitOptions) -> BoolArray:
    """Deviation of the displacement since the touch from the core's rigid motion."""
    points, moved = lattice.position[..., :2], np.moveaxis(change, 0, -1)
    core = _core(points, seen.stays, options.core_share)
    motion = fit_rigid_motion(points.reshape(-1, 2), moved.reshape(-1, 2), core.ravel().astype(float))
    if not motion.observable:
        return np.zeros(seen.contact.shape, bool)
    rigid = motion.displacement(points)
    least = np.maximum(options.least_deviation, options.deviation_share * np.hypot(rigid[..., 0], rigid[..., 1]))
    away: BoolArray = np.hypot(*np.moveaxis(moved - rigid, -1, 0)) > least
    return away


def _core(points: FloatArray, contact: BoolArray, share: float) -> BoolArray:
    if not contact.any():
        return contact
    distance = np.hypot(*np.moveaxis(points - points[contact].mean(axis=0), -1, 0))
    near: BoolArray = contact & (distance <= np.quantile(distance[contact], share))
    return near


METHOD = threshold_method(RigidFitOptions, measure, slips)
