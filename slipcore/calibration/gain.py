"""What a sensor's normal force must be multiplied with, where the force on the body is known."""

import math
from typing import NamedTuple

import numpy as np

from slipcore.calibration.defaults import ESTIMATE
from slipcore.calibration.estimate import PressEstimate, PressResult, error_of_mean
from slipcore.calibration.press import PressLog
from slipcore.calibration.zero import NO_ZERO, elapsed
from slipcore.frames import BoolArray, reported

NO_FORCE = (
    "no total force is given: hold a known weight, press by a scale and say with how much, or record the "
    "gripper's force"
)


class _TotalForce(NamedTuple):
    """Mean normal force on the body, ``newton`` N, in these ``frames`` [k]; ``error`` as a share of it."""

    frames: BoolArray
    newton: float
    error: float


def gain(press: PressLog, known_force: float | None) -> PressResult:
    """The total force on the body over the sum of the sensor's normal forces, in the hold.

    ``known_force`` N is taken as exact. Where it is None the force is what the log's gripper reports, whose error more
    presses do not average out.
    """
    total = _of_gripper(press) if known_force is None else _TotalForce(press.held, known_force, 0.0)
    if total is None:
        return NO_FORCE
    if press.split is None:
        return "the log has no forces"
    if press.zero is None:
        return NO_ZERO
    if press.reaches_edge:
        return "the contact reaches the lattice's edge: press in its middle"
    held = press.split[total.frames, ..., 2].sum(axis=(1, 2))
    elements = math.prod(press.log.grid)
    error = math.hypot(error_of_mean(held - held.mean()), elements * float(press.zero.offset_error[2]))
    strayed = elements * float(press.zero.strayed(float(elapsed(press.log)[total.frames].mean()))[2])
    value, size = total.newton / float(held.mean()), float(np.abs(held.mean()))
    return PressEstimate(value, value * error / size, value * math.hypot(strayed / size, total.error))


def _of_gripper(press: PressLog) -> _TotalForce | None:
    """By the gripper's report in the hold; None where there is none."""
    given, deviation = press.log.gripper_force, press.log.gripper_force_deviation
    if given is None:
        return None
    frames = press.held & np.isfinite(reported(given))
    if not frames.any():
        return None
    newton = float(given[frames].mean())
    return _TotalForce(frames, newton, ESTIMATE.force_tolerance if deviation is None else deviation / newton)
