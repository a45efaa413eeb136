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
    ``rim_noise`` multiples of that of the curvature; the share of the peak that is enough inside the rim of a contact;
    the share of the rim's hollow that still counts as inside, and the multiple of noise at which it is looked at.
    """

    least: float
    share: float
    noise: float
    release: float
    rim: float
    rim_noise: float
    reach: float
    inside: float
    clear: float


TOUCH = len(ContactThreshold._fields)
CURVATURE_NOISE = 0.6374
"""Standard deviation of ``curvature`` for white noise of 1 (from the 25 weights of its stencil)."""


@compiled
def find_contact(
    pressing: FloatArray, sigma: float, before: BoolArray, touch: ContactThreshold, contact: BoolArray
) -> None:
    """Elements pressed (N, or m of indentation, positive inwards) by more than a threshold tied to the frame.

    ``sigma``: noise of ``pressing``, NaN where unknown. Elements in contact ``before`` are released only under
    ``release`` of the threshold. Where the shape is hollow the contact has ended, and up to there it reaches.
    """
    n, m = pressing.shape
    peak = 0.0
    for i in range(n):
        for j in range(m):
            peak = max(peak, pressing[i, j])
    if math.isnan(sigma):
        sigma = spatial_noise(pressing)
    known = 0.0 if math.isnan(sigma) else sigma
    threshold = max(touch.least, touch.share * peak, touch.noise * known)
    for i in range(n):
        for j in range(m):
            p = pressing[i, j]
            contact[i, j] = p > threshold or (before[i, j] and p > touch.release * threshold)
    if touch.rim < 1.0 and min(n, m) >= 3:
        noise, bend = CURVATURE_NOISE * known, curvature(pressing)
        hollow = max(touch.rim_noise * noise, touch.rim * peak)
        for i in range(n):
            for j in range(m):
                contact[i, j] &= bend[i, j] <= hollow
        inside = touch.inside * touch.rim * peak
        if inside > touch.clear * noise and not contact.all():
            reach_rim(pressing, bend, max(touch.least, touch.noise * known, touch.reach * peak), inside, contact)


@compiled
def reach_rim(pressing: FloatArray, bend: FloatArray, least: float, hollow: float, contact: BoolArray) -> None:
    """Let the contact reach to where the shape bends by ``hollow``, m, from what was found.

    Elements pressed by ``least`` join that hang together with those found: a bonded gel is so flat at the rim that this
    lies far under half of the depth. They do, each once, beside three that touch: those along a straight edge, more
    than show through a single gap. None do where no rim is met: around a contact of many elements on a half-space the
    shape bends by little from one to the next.
    """
    n, m = contact.shape
    found, may = contact.copy(), (bend <= hollow) & (pressing > least)
    beside, waiting = np.zeros((n, m), np.int64), np.empty((n * m, 2), np.int64)
    count = 0
    for i in range(n):
        for j in range(m):
            if contact[i, j]:
                waiting[count, 0], waiting[count, 1] = i, j
                count += 1
    while count > 0:
        count -= 1
        row, column = waiting[count, 0], waiting[count, 1]
        for i in range(max(row - 1, 0), min(row + 2, n)):
            for j in range(max(column - 1, 0), min(column + 2, m)):
                beside[i, j] += 1
                if beside[i, j] >= 3 and may[i, j] and not contact[i, j]:
                    contact[i, j] = True
                    waiting[count, 0], waiting[count, 1] = i, j
                    count += 1
    if not is_rimmed(contact, found, bend, hollow):
        contact[:] = found


@compiled
def is_rimmed(contact: BoolArray, found: BoolArray, bend: FloatArray, hollow: float) -> bool:
    """Whether the shape bends by ``hollow`` along half or more of the outline.

    The lattice's edge is no rim where the contact has come to it from what was ``found``.
    """
    n, m = contact.shape
    outline = rim = 0
    for i in range(n):
        for j in range(m):
            if contact[i, j] and not found[i, j]:
                outline += not (0 < i < n - 1 and 0 < j < m - 1)
            elif not contact[i, j] and neighbours(contact, i, j):
                outline += 1
                rim += bend[i, j] > hollow
    return 2 * rim >= outline > 0


@compiled
def neighbours(contact: BoolArray, i: int, j: int) -> int:
    """How many of the eight neighbours touch."""
    n, m = contact.shape
    count = 0
    for a in range(max(i - 1, 0), min(i + 2, n)):
        for b in range(max(j - 1, 0), min(j + 2, m)):
            count += contact[a, b]
    return int(count - contact[i, j])


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
