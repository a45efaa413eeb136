"""How wide a sensor smooths forces, from a contact that grows.

The second moment of a smoothed field is that of the field plus the kernel's, whatever their shapes (moments about the
mean add under convolution). That of a round contact vanishes with the force: what is left at none is the kernel's.
"""

import math
from typing import NamedTuple

import numpy as np
from scipy.ndimage import binary_dilation

from slipcore.calibration.defaults import ESTIMATE, PRESS
from slipcore.calibration.estimate import Estimate, PressEstimate, PressResult, joined, unknown
from slipcore.calibration.press import PressLog
from slipcore.frames import BoolArray, FloatArray

NAME, UNIT = "kernel_width", "m"


class _Growth(NamedTuple):
    """Normal force [k] N, second moment along one axis [k] m², and the error of it."""

    force: FloatArray
    moment: FloatArray
    error: FloatArray


def kernel_width(found: list[PressResult]) -> Estimate:
    """Standard deviation of the kernel along one axis, m, from its squares; 0 where these are within their error."""
    square = joined(NAME, UNIT, found)
    if not square.is_identified:
        return unknown(NAME, UNIT, str(square.not_identified))
    low, value, high = (math.sqrt(max(each, 0.0)) for each in (square.low, square.value, square.high))
    return Estimate(NAME, UNIT, value, low, high)


def squared_width(press: PressLog) -> PressResult:
    """The second moment that is left at no force, m²."""
    if press.split is None:
        return "the log has no forces"
    if press.reaches_edge:
        return "the contact reaches the lattice's edge: press in its middle"
    growth = _growth(press, press.split)
    if len(growth.force) < ESTIMATE.kernel_frames:
        return f"{len(growth.force)} frames while the load changes; {ESTIMATE.kernel_frames} are needed: press slowly"
    least = growth.force.min() / growth.force.max()
    if least > ESTIMATE.kernel_force_range:
        return f"the least force is {least:.0%} of the greatest: begin before the touch, and press slowly"
    known = growth.force >= ESTIMATE.kernel_force_range * growth.force.max()
    light, heavy = np.median(growth.moment[~known]), np.median(growth.moment[known])
    if heavy - light < ESTIMATE.kernel_growth * heavy:
        return "the contact does not grow with the force: press with a ball, not with something flat"
    return _left_at_no_force(growth, press.log.element_area)


def _growth(press: PressLog, split: FloatArray) -> _Growth:
    """Of all frames in contact whose force is well above its noise.

    Each over no more of the lattice than its contact and kernel need, since noise far out counts by its arm's square.
    """
    around = binary_dilation(press.footprint, iterations=ESTIMATE.kernel_margin)
    place, field = press.log.position[around][:, :2], split[:, around, 2]
    force = field.sum(axis=1)
    noise = float(field[press.free].std()) if press.free.any() else 0.0
    seen = ~press.free & (force > ESTIMATE.kernel_force_to_noise * noise * math.sqrt(field.shape[1]))
    seen &= force > PRESS.free_share * force.max()
    middle = np.broadcast_to(_middle(field[force == force.max()], place), (int(seen.sum()), 2))
    reach = np.full(len(middle), np.inf)
    for _ in range(ESTIMATE.kernel_passes if seen.any() else 0):
        arm = place - middle[:, None]
        inside = (arm**2).sum(axis=-1) <= (reach**2)[:, None]
        growth = _moments(np.where(inside, field[seen], 0.0), arm, inside, noise)
        even = np.ones_like(growth.force)
        line = _line(growth, ESTIMATE.kernel_exponent, even)
        reach = ESTIMATE.kernel_reach * np.sqrt(np.maximum(line.at(growth.force), press.log.element_area))
    return growth if seen.any() else _Growth(np.empty(0), np.empty(0), np.empty(0))


def _middle(field: FloatArray, place: FloatArray) -> FloatArray:
    """Centre of normal forces [1, k] at places [k, 2]: that of the strongest frame, for a body goes straight down."""
    centre: FloatArray = (field @ place / field.sum(axis=1, keepdims=True))[0]
    return centre


def _moments(field: FloatArray, arm: FloatArray, inside: BoolArray, noise: float) -> _Growth:
    """Of fields [k, elements] N with arms [k, elements, 2] m."""
    force = field.sum(axis=1)
    square = 0.5 * (arm**2).sum(axis=-1)
    moment = (field * square).sum(axis=1) / force
    deviations = np.where(inside, square - moment[:, None], 0.0)
    error = np.hypot(noise * np.sqrt((deviations**2).sum(axis=1)) / force, ESTIMATE.kernel_shape_error * moment)
    return _Growth(force, moment, error)


def _left_at_no_force(growth: _Growth, element_area: float) -> PressEstimate:
    """Over exponents of the contact's growth, weighted by how likely each is.

    A force on an element is its sum over it, or its density there: the moment holds area/12 of it, or nothing.
    """
    weight = 1.0 / growth.error**2
    exponents = np.linspace(ESTIMATE.kernel_exponent_low, ESTIMATE.kernel_exponent_high, ESTIMATE.kernel_exponents)
    lines = [_line(growth, exponent, weight) for exponent in exponents]
    left, variance, misfit = (np.array([getattr(line, name) for line in lines]) for name in _Line._fields[:3])
    scale = max(float(misfit.min()) / max(len(growth.force) - 3, 1), 1.0)
    likely = np.exp(-0.5 * (misfit - misfit.min()) / scale)
    likely /= likely.sum()
    mean = float(likely @ left)
    spread = float(likely @ (scale * variance + (left - mean) ** 2))
    unsure = element_area / 24.0
    return PressEstimate(mean - unsure, math.hypot(math.sqrt(spread), unsure))


class _Line(NamedTuple):
    """Moment over force to an exponent: what is ``left`` at none, its variance at unit weight, the sum of squares, and
    the slope over (force/``largest``)**``exponent``.
    """

    left: float
    variance: float
    misfit: float
    slope: float
    largest: float
    exponent: float

    def at(self, force: FloatArray) -> FloatArray:
        """The moment at forces [k] N."""
        moment: FloatArray = self.left + self.slope * (force / self.largest) ** self.exponent
        return moment


def _line(growth: _Growth, exponent: float, weight: FloatArray) -> _Line:
    largest = float(growth.force.max())
    terms = np.stack([np.ones_like(growth.force), (growth.force / largest) ** exponent], axis=1)
    root = np.sqrt(weight)
    q, r = np.linalg.qr(root[:, None] * terms)
    inverse = np.linalg.inv(r)
    found = inverse @ (q.T @ (root * growth.moment))
    misfit = float(weight @ (growth.moment - terms @ found) ** 2)
    return _Line(float(found[0]), float(inverse[0] @ inverse[0]), misfit, float(found[1]), largest, exponent)
