"""Which elements touch the object: from forces where there are any, from the pressed shape otherwise."""

import math
from typing import NamedTuple

import numpy as np

from slipcore.compilation import compiled
from slipcore.defaults import DEVIATION_TO_SIGMA, NOISE
from slipcore.frames import BoolArray, FloatArray
from slipcore.noise import median

_LEAST = NOISE.least_series


class ContactThreshold(NamedTuple):
    """What an element needs to touch: ``least`` N or m, ``share`` of the frame's peak, ``noise`` multiples of it; the
    share of that under which it is released; the rim's least hollow, as a share of the peak (1: not looked at), and
    ``rim_noise`` multiples of that of the curvature; and for ``is_bonded`` the share of the peak that is enough on a
    bonded gel (``reach``), how many times as many elements may reach that, and how many of the lattice's edge.
    """

    least: float
    share: float
    noise: float
    release: float
    rim: float
    rim_noise: float
    reach: float
    widening: float
    edge: float


TOUCH = len(ContactThreshold._fields)
CURVATURE_NOISE = 0.6374
"""Standard deviation of ``curvature`` for white noise of 1 (from the 25 weights of its stencil)."""


@compiled
def find_contact(
    pressing: FloatArray, sigma: float, before: BoolArray, touch: ContactThreshold, contact: BoolArray
) -> None:
    """Elements pressed (N, or m of indentation, positive inwards) by more than a threshold tied to the frame.

    ``sigma``: noise of ``pressing``, NaN where unknown. Elements in contact ``before`` are released only under
    ``release`` of the threshold. Where the shape is hollow the contact has ended; on a bonded gel, whose rim lies far
    under half of the depth, a share of the peak tells the contact from what is beside it better.
    """
    n, m = pressing.shape
    peak = 0.0
    for i in range(n):
        for j in range(m):
            peak = max(peak, pressing[i, j])
    if math.isnan(sigma):
        sigma = spatial_noise(pressing)
    known = 0.0 if math.isnan(sigma) else sigma
    looks = touch.rim < 1.0 and min(n, m) >= 3
    bonded = looks and is_bonded(pressing, peak, touch)
    threshold = max(touch.least, (touch.reach if bonded else touch.share) * peak, touch.noise * known)
    for i in range(n):
        for j in range(m):
            p = pressing[i, j]
            contact[i, j] = p > threshold or (before[i, j] and p > touch.release * threshold)
    if looks and not bonded:
        hollow, bend = max(touch.rim_noise * CURVATURE_NOISE * known, touch.rim * peak), curvature(pressing)
        for i in range(n):
            for j in range(m):
                contact[i, j] &= bend[i, j] <= hollow


@compiled
def is_bonded(pressing: FloatArray, peak: float, touch: ContactThreshold) -> bool:
    """Whether the surface beside the contact falls as fast as that of a thin gel bonded to its back: fewer elements
    than ``widening`` times those that lie above ``share`` of the peak lie above ``reach`` of it.

    On a half-space they are about seven times as many (Hertz), whatever the contact's size, so that they come to the
    lattice's edge unless it is wide; where more than the share ``edge`` of that lie so deep, it cannot be told.
    """
    n, m = pressing.shape
    high = low = beside = 0
    for i in range(n):
        for j in range(m):
            high += pressing[i, j] > touch.share * peak
            if pressing[i, j] > touch.reach * peak:
                low += 1
                beside += i == 0 or j == 0 or i == n - 1 or j == m - 1
    return low < touch.widening * high and beside < touch.edge * 2 * (n + m - 2)


@compiled
def curvature(field: FloatArray) -> FloatArray:
    """Laplacian of a field [n, m] smoothed over 3 × 3 neighbours (weights 1-2-1), times the pitch squared: [n, m].

    The edge is continued with its own slope: smoothing leaves it as it is, and it does not bend across.
    """
    n, m = field.shape
    rows = field.copy()
    for i in range(1, n - 1):
        for j in range(m):
            rows[i, j] = 0.25 * (field[i - 1, j] + 2.0 * field[i, j] + field[i + 1, j])
    smooth = rows.copy()
    for i in range(n):
        for j in range(1, m - 1):
            smooth[i, j] = 0.25 * (rows[i, j - 1] + 2.0 * rows[i, j] + rows[i, j + 1])
    bend = np.zeros((n, m))
    for i in range(n):
        for j in range(m):
            if 0 < i < n - 1:
                bend[i, j] += smooth[i - 1, j] - 2.0 * smooth[i, j] + smooth[i + 1, j]
            if 0 < j < m - 1:
                bend[i, j] += smooth[i, j - 1] - 2.0 * smooth[i, j] + smooth[i, j + 1]
    return bend


@compiled
def spatial_noise(pressing: FloatArray) -> float:
    """Noise of a single frame, from the elements that seem to pull: an object does not, so only noise does.

    Half of a symmetric noise is negative; its median magnitude is Φ⁻¹(¾) σ. NaN with too few of them. What a contact
    moves outwards beside itself only makes the estimate larger, which is on the safe side for the two frames before a
    noise over time is known.
    """
    pulling = np.empty(pressing.size)
    count = 0
    for value in pressing.flat:
        if value < 0.0:
            pulling[count] = -value
            count += 1
    return DEVIATION_TO_SIGMA * median(pulling[:count]) if count >= _LEAST else math.nan
