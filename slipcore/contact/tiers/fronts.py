"""Areas within fronts that run through cells: of contact and, in it, of stick.

Cells along them are taken as they are, not as ``edges.py`` corrects them: that halves the mean error of the stick ratio
on fine grids, but not its largest, and takes as long as the frame itself.
"""

import numpy as np

from slipcore.contact.defaults import ACCURACY
from slipcore.contact.solver.state import StepResult
from slipcore.frames import BoolArray, FloatArray


def stick_ratio(result: StepResult) -> float:
    """Stick area over contact area, both within their fronts; NaN without contact.

    Pressure falls to the contact's edge, and μp − |q| to that of stick, with the root of the distance (Hertz;
    Cattaneo–Mindlin, Mindlin–Deresiewicz), so that their squares are linear there. Where no cell slides between stick
    and what does not touch, both have one edge.
    """
    if not result.contact.any():
        return float("nan")
    spare = result.limit - np.hypot(result.force[0], result.force[1])
    touches = shares_within(result.force[2] ** 2, result.contact)
    sticks = shares_within(np.where(result.at_limit, 0.0, spare) ** 2, result.contact & ~result.at_limit)
    sticks = np.where(_near(result.contact & result.at_limit), np.minimum(sticks, touches), touches)
    return min(float(sticks.sum() / touches.sum()), 1.0)


def shares_within(field: FloatArray, inside: BoolArray) -> FloatArray:
    """Share of each cell [ny, nx] in which a field is above zero that is known in the cells ``inside`` only.

    It goes on linearly to the cells beside these, as long as it falls towards them: where it ends without falling, as
    the pressure of a flat punch does, cells count whole.
    """
    padded, known = np.pad(np.where(inside, field, 0.0), 2), np.pad(inside, 2)
    total, count = np.zeros_like(padded), np.zeros_like(padded)
    for rows, columns in ((0, 1), (0, -1), (1, 0), (-1, 0)):  # from a neighbour to the cell
        near, far = (np.roll(padded, (k * rows, k * columns), (0, 1)) for k in (1, 2))
        both = np.logical_and(*(np.roll(known, (k * rows, k * columns), (0, 1)) for k in (1, 2)))
        falls = ~known & both & (near < far)
        total += np.where(falls, 2.0 * near - far, 0.0)
        count += falls
    beside = count > 0.0
    continued = np.where(beside, np.minimum(total / np.maximum(count, 1.0), 0.0), padded)
    return _shares(continued, known, beside)[2:-2, 2:-2]


def _shares(field: FloatArray, inside: BoolArray, beside: BoolArray) -> FloatArray:
    """Share of each cell in which a linear field is above zero: all of those ``inside`` but at their edge."""
    known, slopes = inside | beside, list[FloatArray]()
    for axis in (0, 1):
        has_ahead, has_behind = np.roll(known, -1, axis), np.roll(known, 1, axis)
        ahead, behind = np.roll(field, -1, axis) - field, field - np.roll(field, 1, axis)
        slope = np.where(has_ahead, ahead, 0.0) + np.where(has_behind, behind, 0.0)
        slopes.append(np.abs(slope) / np.maximum(has_ahead.astype(float) + has_behind, 1.0))
    steep, flat = np.maximum(*slopes), np.minimum(*slopes)
    partly = (beside | (inside & _near(~inside))) & (steep > 0.0)
    shares = inside.astype(float)
    shares[partly] = share_above_zero(field[partly], steep[partly], flat[partly])
    return shares


def share_above_zero(middle: FloatArray, steep: FloatArray, flat: FloatArray) -> FloatArray:
    """Share of a unit square in which a linear field is above zero, by its value in the middle and its two slopes, of
    which the steeper one is above zero.
    """
    flat = np.maximum(flat, ACCURACY.flattest * steep)
    corner = middle + 0.5 * (steep + flat)
    cut = [np.maximum(corner - drop, 0.0) ** 2 for drop in (0.0, steep, flat, steep + flat)]
    return np.asarray(np.clip((cut[0] - cut[1] - cut[2] + cut[3]) / (2.0 * steep * flat), 0.0, 1.0))


def _near(mask: BoolArray) -> BoolArray:
    """The cells of a mask [ny, nx] and those that share a side with one of them."""
    wide = np.pad(mask, 1)
    return np.asarray(mask | wide[:-2, 1:-1] | wide[2:, 1:-1] | wide[1:-1, :-2] | wide[1:-1, 2:])
