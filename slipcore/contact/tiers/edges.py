"""Stress at the centres of the cells along an edge of contact or of stick, and the area within the edge.

Pressure ends as K√d, d the distance from the edge (Johnson 1985, §4.2, 5.1), and so does μp − |q| where stick ends.
Cells of even stress that meet the conditions of contact at their centres have another stress there, by a part of it
that stays the same on any grid: for this, errors of stress fall with the cell and no faster. That part of pressure is
the same for all bodies. Where cells are small against the contact, bodies respond as 1/r, the edge is straight, and K√d
has no length of its own, so that how far a cell seems to be from the edge, by the square of its stress over the slope
of that, less how far it is, depends on this distance and on the edge's angle to the grid alone, in cells.
``edge_cells.csv`` has it from a sphere on fine grids of squares (``benchmarks/contact/edge_cells.py``).

Of traction all of that part goes at ν = 0 only. Otherwise bodies respond to it as (1 + η cos 2ψ)/r, ψ the angle to it
and η = ν/(2 − ν) (Johnson 1985, eq. 3.75): along slip the part is another then, and there is one across slip, which
stays. Where pressure and traction move each other, stress does not end as a root. In both cases errors become smaller,
but stay in proportion to the cell.
"""

from collections.abc import Iterable, Iterator
from functools import cache
from importlib.resources import files
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt, map_coordinates

from slipcore.contact.defaults import EDGES, TINY
from slipcore.contact.solver.state import StepResult
from slipcore.contact.tiers.fronts import share_above_zero
from slipcore.frames import BoolArray, FloatArray


class AlongEdge(NamedTuple):
    """Near an edge of a field: its ``square`` [ny, nx] at the centres of cells, below zero beyond the edge, and the
    slope of that [2, ny, nx] along x and y, a cell; ``corrected`` [ny, nx]: the cells, some beyond the edge, that have
    these.
    """

    square: FloatArray
    slope: FloatArray
    corrected: BoolArray


def centre_forces(results: Iterable[StepResult]) -> Iterator[FloatArray]:
    """Force N [3, ny, nx] that cells, squares, would have of the stress at their centres, in steps from the first on.

    Its sum isn't the load: stress between the centres isn't that of an even cell. What an earlier edge of stick left in
    cells that stick stays, as long as no edge is within ``EDGES.apart`` cells again; not so what a smaller contact's
    edge left.
    """
    kept: FloatArray | None = None
    for result in results:
        slides = result.contact & result.at_limit
        sticks, along = result.contact & ~slides, result.force[:2]
        pressed = centre_field(result.force[2], result.contact)
        share = np.divide(pressed, result.force[2], out=np.zeros_like(pressed), where=result.contact)
        slip = _direction_of_slip(along, slides)
        spare = result.limit - (slip * along).sum(axis=0)
        change = (share - 1.0) * along + np.where(sticks, slip * (share * spare - centre_field(spare, sticks)), 0.0)
        kept = change if kept is None else change + np.where(_depth(sticks)[0] > EDGES.apart, kept, 0.0)
        yield np.concatenate((along + kept, pressed[None]))


def _direction_of_slip(along: FloatArray, slides: BoolArray) -> FloatArray:
    """Direction of traction [2, ny, nx] in the nearest cell that slides, of length one; zero if none does."""
    if not slides.any():
        return np.zeros_like(along)
    rows, columns = distance_transform_edt(~slides, return_distances=False, return_indices=True)
    nearest = along[:, rows, columns]
    return np.asarray(nearest / np.maximum(np.hypot(*nearest), TINY))


def centre_field(field: FloatArray, inside: BoolArray) -> FloatArray:
    """Values [ny, nx] at the centres of square cells of a field ≥ 0 that ends with a root; zero outside of ``inside``.

    Fields that end otherwise, as the pressure of a flat punch does, and cells without enough others around them stay
    as they are.
    """
    near = _along_edge(field, inside)
    return np.where(inside, np.where(near.corrected, np.sqrt(np.maximum(near.square, 0.0)), field), 0.0)


def shares_within_edge(field: FloatArray, inside: BoolArray) -> FloatArray:
    """Share of each cell [ny, nx], a square, within the edge of a field that is known in the cells ``inside``.

    Cells along an edge at which the field does not end with a root count whole.
    """
    near, shares = _along_edge(field, inside), inside.astype(float)
    flat, steep = np.sort(np.abs(near.slope[:, near.corrected]), axis=0)
    shares[near.corrected] = share_above_zero(near.square[near.corrected], steep, flat)
    return shares


def _along_edge(field: FloatArray, inside: BoolArray) -> AlongEdge:
    measured = np.where(inside, field, 0.0) ** 2
    square, slopes, corrected = measured.copy(), np.zeros((2, *inside.shape)), np.zeros_like(inside)
    if not inside.any():
        return AlongEdge(square, slopes, corrected)
    depth, inward = _depth(inside)
    near = (depth < EDGES.depth) & (depth > -EDGES.beside)
    own, within, (around, parabolas) = measured[near], inside[near], _parabolas(inside, near)
    for _ in range(EDGES.rounds):
        level, *slope = (parabolas @ _padded(square)[around][..., None])[..., 0].T
        steep = np.hypot(*slope)
        towards = slope[0] * inward[0][near] + slope[1] * inward[1][near] > 0.0
        distance = np.where(within, own, level) / np.where(towards, steep, 1.0)
        fits = towards & (np.abs(distance - depth[near]) <= 1.0)
        distance = np.where(within, distance - _excess(distance, *slope), np.minimum(distance, 0.0))
        square[near] = np.where(fits, steep * distance, own)
    slopes[:, near], corrected[near] = slope, fits
    return AlongEdge(square, slopes, corrected)


def _depth(inside: BoolArray) -> tuple[FloatArray, FloatArray]:
    """How far cells [ny, nx] are within an edge half a cell from the nearest cell beyond it, or beyond the grid, below
    zero if they are not inside, in cells; and the direction [2, ny, nx] from there inwards, of length one.
    """
    cells = np.pad(inside, 1)
    (within, outer), (beyond, inner) = (distance_transform_edt(part, return_indices=True) for part in (cells, ~cells))
    places = np.indices(cells.shape)
    across = np.where(cells, places - outer, inner - places)[::-1] / np.maximum(within, beyond)
    return np.where(cells, within - 0.5, 0.5 - beyond)[1:-1, 1:-1], across[:, 1:-1, 1:-1]


def _parabolas(inside: BoolArray, near: BoolArray) -> tuple[NDArray[np.int64], FloatArray]:
    """Places [cells, k] on the padded grid around the cells ``near``, and what gives value and slope [cells, 3, k] at
    these by the parabola through a field in those around them that are inside (least squares).

    By normal equations: a window that cells determine has a condition number of 195 at most, in cells, and 10 inside,
    so that its square leaves eleven digits.
    """
    reach = int(EDGES.window)
    offsets = np.indices((2 * reach + 1, 2 * reach + 1)).reshape(2, -1) - reach
    y, x = offsets[:, np.hypot(*offsets) <= EDGES.window]
    known, (rows, columns), length = _padded(inside.astype(float)), np.nonzero(near), inside.shape[1] + 2 * reach
    around = ((rows + reach) * length + columns + reach)[:, None] + y * length + x
    terms = np.stack((np.ones(len(x)), x, y, x**2, x * y, y**2))
    products = (terms[:, None] * terms).reshape(-1, len(x))
    normal = (known[around] @ products.T).reshape(-1, len(terms), len(terms))
    normal += EDGES.rounding * np.trace(normal, axis1=1, axis2=2)[:, None, None] * np.eye(len(terms))
    first = np.linalg.solve(normal, np.broadcast_to(np.eye(len(terms), 3), (len(rows), len(terms), 3)))
    return around, np.swapaxes(first, 1, 2) @ terms * known[around][:, None]


def _padded(field: FloatArray) -> FloatArray:
    """A field with zeros around it, row by row."""
    return np.pad(field, int(EDGES.window)).ravel()


def _excess(distance: FloatArray, along_x: FloatArray, along_y: FloatArray) -> FloatArray:
    """How much farther from the edge cells seem to be than they are, by how far they seem and by the slope."""
    table = _table()
    step = EDGES.table_reach / (len(table) - 1)
    far = np.sqrt(np.maximum(distance, 0.0))
    low, high = np.sort(np.abs((along_x, along_y)), axis=0)
    turn = np.arctan2(low, high) * (table.shape[1] - 1) / (np.pi / 4.0)
    found = map_coordinates(table, (np.minimum(far, EDGES.table_reach) / step, turn), order=1, mode="nearest")
    return np.asarray(found * np.minimum(1.0, EDGES.table_reach / np.maximum(far, EDGES.table_reach)) ** 2)


@cache
def _table() -> FloatArray:
    """By the root of how far cells seem to be from an edge, in even steps, and by its angle from 0 to 45°."""
    return np.loadtxt(str(files("slipcore.contact.tiers") / "edge_cells.csv"), delimiter=",")
