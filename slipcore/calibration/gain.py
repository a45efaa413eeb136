"""What a sensor's normal force must be multiplied with, where the force on the body is known."""

import math

import numpy as np

from slipcore.calibration.estimate import PressEstimate, PressResult, error_of_mean
from slipcore.calibration.press import PressLog
from slipcore.calibration.zero import NO_ZERO, elapsed


def gain(press: PressLog, known_force: float | None) -> PressResult:
    """Known force over the sum of normal forces in the hold; ``known_force`` N."""
    if known_force is None:
        return "no total force is given: hold a known weight, or press by a scale, and say with how much"
    if press.split is None:
        return "the log has no forces"
    if press.zero is None:
        return NO_ZERO
    if press.reaches_edge:
        return "the contact reaches the lattice's edge: press in its middle"
    held = press.split[press.held, ..., 2].sum(axis=(1, 2))
    elements = math.prod(press.log.grid)
    error = math.hypot(error_of_mean(held - held.mean()), elements * float(press.zero.offset_error[2]))
    strayed = elements * float(press.zero.strayed(float(elapsed(press.log)[press.held].mean()))[2])
    value, size = known_force / float(held.mean()), float(np.abs(held.mean()))
    return PressEstimate(value, value * error / size, value * strayed / size)
