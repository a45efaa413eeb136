"""Tangential force that a sensor reports of a body that is pressed straight down."""

import numpy as np

from slipcore.calibration.defaults import ESTIMATE
from slipcore.calibration.estimate import PressEstimate, PressResult, error_of_mean
from slipcore.calibration.press import PressLog, load_terms, marker_motion
from slipcore.calibration.zero import NO_ZERO, elapsed
from slipcore.frames import FloatArray, unit


def crosstalk(press: PressLog) -> list[PressResult]:
    """Along x and along y, the share of the normal force that appears as tangential force.

    Of the sums over the footprint, in which parts that point inwards all around cancel. Its error holds that of noise,
    and the load sideways that the motion of markers leaves room for.
    """
    if press.split is None:
        return ["the log has no forces"] * 2
    if press.depth == 0.0:
        return ["no marker is pressed in, against which its motion sideways would show a load that leans"] * 2
    if press.zero is None:
        return [NO_ZERO] * 2
    shares, errors = _proportional(press)
    leaning = np.abs(marker_motion(press)[0].mean(axis=0)) * ESTIMATE.sideways_stiffness / press.depth
    errors = np.hypot(errors, leaning)
    when, pressed = float(elapsed(press.log)[press.pressed].mean()), float(press.normal_force[press.pressed].mean())
    strayed = np.count_nonzero(press.footprint) * press.zero.strayed(when)[:2] / pressed
    return [PressEstimate(*map(float, each)) for each in zip(shares, errors, strayed, strict=True)]


def _proportional(press: PressLog) -> tuple[FloatArray, FloatArray]:
    """Slopes of tangential over normal force [2] beside an offset and, where it is known, a drift; their errors."""
    terms, load = load_terms(press)
    found = np.linalg.lstsq(terms, load)[0]
    residual = load - terms @ found
    spread = float((np.linalg.inv(np.linalg.qr(terms, mode="r"))[0] ** 2).sum())  # of (AᵀA)⁻¹, not by way of AᵀA
    errors = np.array([error_of_mean(axis) * np.sqrt(len(axis) * spread) for axis in residual.T])
    return found[0], errors


def inward_share(press: PressLog) -> PressResult:
    """Tangential force that points to the middle of the contact, over normal force, summed up over the footprint.

    It goes with the contact, so that no property of single elements makes it: the body's and the gel's own elasticity
    does, or a reconstruction of forces.
    """
    if press.split is None:
        return "the log has no forces"
    if press.zero is None:
        return NO_ZERO
    force = press.split[press.pressed][:, press.footprint]
    place, normal = press.log.position[press.footprint][:, :2], np.maximum(force[..., 2:], 0.0)
    arm = (normal * place).sum(axis=1, keepdims=True) / normal.sum(axis=1, keepdims=True) - place
    share = (force[..., :2] * unit(arm)).sum(axis=(1, 2)) / normal.sum(axis=(1, 2))
    error = np.hypot(error_of_mean(share - share.mean()), _zero_error(press) / normal.sum(axis=(1, 2)).mean())
    return PressEstimate(float(share.mean()), float(error))


def _zero_error(press: PressLog) -> float:
    """Standard error of a component's sum over the footprint that single elements' zeros make, N."""
    assert press.split is not None
    still = press.split[press.free][:, press.footprint, :2]
    return float(still.std() * np.sqrt(np.count_nonzero(press.footprint) / len(still)))
