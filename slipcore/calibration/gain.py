"""What a sensor's normal force must be multiplied with, where the force on the body is known."""

import math

import numpy as np

from slipcore.calibration.defaults import ESTIMATE
from slipcore.calibration.estimate import PressEstimate, PressResult, error_of_mean
from slipcore.calibration.press import PressLog
from slipcore.calibration.zero import NO_ZERO, elapsed
from slipcore.frames import BoolArray, GraspLog, reported


def gain(press: PressLog, known_force: float | None) -> PressResult:
    """Known force over the sum of normal forces in the hold: ``known_force`` N, taken as exact, or where it is None
    what the log's gripper reports, whose error more presses do not average out.
    """
    log, frames = press.log, press.held
    if known_force is None and log.gripper_force is not None:
        frames = frames & np.isfinite(reported(log.gripper_force))
    if known_force is None and (log.gripper_force is None or not frames.any()):
        return (
            "no total force is given: hold a known weight, press by a scale and say with how much, or record the "
            "gripper's force"
        )
    if press.split is None:
        return "the log has no forces"
    if press.zero is None:
        return NO_ZERO
    if press.reaches_edge:
        return "the contact reaches the lattice's edge: press in its middle"
    held = press.split[frames, ..., 2].sum(axis=(1, 2))
    elements = math.prod(log.grid)
    error = math.hypot(error_of_mean(held - held.mean()), elements * float(press.zero.offset_error[2]))
    strayed = elements * float(press.zero.strayed(float(elapsed(log)[frames].mean()))[2])
    force, unsure = (known_force, 0.0) if known_force is not None else _of_gripper(log, frames)
    value, size = force / float(held.mean()), float(np.abs(held.mean()))
    return PressEstimate(value, value * error / size, value * math.hypot(strayed / size, unsure))


def _of_gripper(log: GraspLog, frames: BoolArray) -> tuple[float, float]:
    """The mean force N that the gripper reports in these frames, and its error as a share of it."""
    assert log.gripper_force is not None
    force = float(log.gripper_force[frames].mean())
    deviation = log.gripper_force_deviation
    return force, ESTIMATE.force_tolerance if deviation is None else deviation / force
