"""Stress at the centres of the cells along an edge of contact or of stick, and the area within the edge.

Pressure ends as K√d, d the distance from the edge (Johnson 1985, §4.2, 5.1), and so does μp − |q| where stick ends.
Cells of even stress that meet the conditions of contact at their centres have another stress there, by a part of it
that stays the same on any grid: for this, errors of stress fall with the cell and no faster. That part of pressure is
the same for all bodies. Where cells are small against the contact, bodies respond as 1/r, the edge is straight, and K√d
has no length of its own, so that how far a cell seems to be from the edge, by the square of its stress over the slope
of that, less how far it is, depends on this distance and on the edge's angle to the grid alone, in cells.

Bodies respond to traction as (1 + η cos 2ψ)/r along slip and as η sin 2ψ/r across it, ψ the angle to it and
η = ν/(2 − ν) (Johnson 1985, eq. 3.75). Near an edge of stick, cells that slide keep still across slip, since stress of
the size of K√cell hardly turns friction. So what is left of μp − |q| depends on η and on the angle of slip to the edge,
too, and there is a part across slip, in units of K√cell, on both sides of the edge. ``edge_cells.csv`` has both, to
second order of η, from stress on a circle with a closed form (``benchmarks/contact/edge_cells.py``).

Where the direction of slip turns within few cells of the edge, as in a thin ring that slides back, less of it goes.
Where pressure and traction move each other, stress does not end as a root: errors become smaller, but stay in
proportion to the cell.

This is for who runs the solver and asks for stress, as in docs/accuracy-contact.md: no log calls it, since elements are
sums over cells, of second order as they are, and the largest errors of stick ratios came out no smaller by it.
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
from slipcore.errors import InvalidInput
from slipcore.frames import BoolArray, FloatArray

EVEN, EXCESS, WITHIN, BEYOND = slice(0, 1), slice(0, 6), slice(6, 11), slice(11, 16)
"""Of the tables: the excess of isotropic bodies and of any, what is across slip within an edge, and beyond it."""


class AlongEdge(NamedTuple):
    """Near an edge of a field: its ``square`` [ny, nx] at the centres of cells, below zero beyond the edge, and the
    slope of that [2, ny, nx] along x and y, a cell; ``corrected`` [ny, nx]: the cells, some beyond the edge, that have
    these; what there is ``across`` slip that should not be [ny, nx]; and the ``field`` [ny, nx] at the centres.
    """

    square: FloatArray
    slope: FloatArray
    corrected: BoolArray
    across: FloatArray
    field: FloatArray


def centre_forces(results: Iterable[StepResult], poisson: float) -> Iterator[FloatArray]:
    """Force N [3, ny, nx] that cells, squares, would have of the stress at their centres, in steps from the first on.

    ``poisson``: ratio of the body, or the mean of two by their shear compliance 1/G, from 0 to 0.5.

    Its sum isn't the load: stress between the centres isn't that of an even cell. What an earlier edge of stick left in
    cells that stick stays, as long as no edge is within ``EDGES.apart`` cells again; not so what a smaller contact's
    edge left. Raises ``InvalidInput`` for other ratios.
    """
    if not 0.0 <= poisson <= 0.5:
        raise InvalidInput("Poisson's ratio", poisson, "0 to 0.5")
    kept: FloatArray | None = None
    for result in results:
        slides = result.contact & result.at_limit
        sticks, along = result.contact & ~slides, result.force[:2]
        pressed = centre_field(result.force[2], result.contact)
        share = np.divide(pressed, result.force[2], out=np.zeros_like(pressed), where=result.contact)
        slip = _direction_of_slip(along, slides)
        spare = result.limit - (slip * along).sum(axis=0)
        stick = _along_edge(spare, sticks, slip, poisson / (2.0 - poisson))
        change = (share - 1.0) * along + np.where(sticks, slip * (share * spare - stick.field), 0.0)
        change += np.where(result.contact, stick.across * np.stack((-slip[1], slip[0])), 0.0)
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
    return _along_edge(field, inside).field


def shares_within_edge(field: FloatArray, inside: BoolArray) -> FloatArray:
    """Share of each cell [ny, nx], a square, within the edge of a field that is known in the cells ``inside``.

    Cells along an edge at which the field does not end with a root count whole.
    """
    near, shares = _along_edge(field, inside), inside.astype(float)
    flat, steep = np.sort(np.abs(near.slope[:, near.corrected]), axis=0)
    shares[near.corrected] = share_above_zero(near.square[near.corrected], steep, flat)
    return shares


def _along_edge(
    field: FloatArray, inside: BoolArray, slip: FloatArray | None = None, anisotropy: float = 0.0
) -> AlongEdge:
    """What is known of the edge of a field; ``slip`` [2, ny, nx]: its direction, which matters with anisotropy."""
    square = np.where(inside, field, 0.0) ** 2
    slopes, across, corrected = np.zeros((2, *inside.shape)), np.zeros_like(square), np.zeros_like(inside)
    if not inside.any():
        return AlongEdge(square, slopes, corrected, across, square)
    depth, inward = _depth(inside)
    near = (depth < EDGES.depth) & (depth > -EDGES.beside)
    own, within, (around, parabolas) = square[near], inside[near], _parabolas(inside, near)
    turned = (np.zeros_like(slopes) if slip is None else slip)[:, near], anisotropy
    for _ in range(EDGES.rounds):
        level, *slope = (parabolas @ _padded(square)[around][..., None])[..., 0].T
        steep = np.hypot(*slope)
        towards = slope[0] * inward[0][near] + slope[1] * inward[1][near] > 0.0
        seems = np.where(within, own, level) / np.where(towards, steep, 1.0)
        fits = towards & (np.abs(seems - depth[near]) <= 1.0)
        distance = np.where(within, seems - _excess(seems, np.stack(slope), *turned), np.minimum(seems, 0.0))
        square[near] = np.where(fits, steep * distance, own)
    slopes[:, near], corrected[near] = slope, fits
    across[near] = np.where(fits, np.sqrt(steep) * _across(seems, within, np.stack(slope), *turned), 0.0)
    found = np.where(corrected, np.sqrt(np.maximum(square, 0.0)), field)
    return AlongEdge(square, slopes, corrected, across, np.where(inside, found, 0.0))


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


def _excess(seems: FloatArray, slope: FloatArray, slip: FloatArray, anisotropy: float) -> FloatArray:
    """How much farther from the edge cells [k] seem to be than they are, by how far they seem, in cells, and by the
    slope there and the direction of slip [2, k].
    """
    which = EXCESS if anisotropy else EVEN
    weights, _ = weights_of(slope, slip, anisotropy)
    return np.asarray((weights[which] * _from_tables(which, seems, slope)).sum(axis=0))


def _across(seems: FloatArray, within: BoolArray, slope: FloatArray, slip: FloatArray, anisotropy: float) -> FloatArray:
    """What there is across slip that should not be [k], over the root of the slope; otherwise as above."""
    if not anisotropy:
        return np.zeros_like(seems)
    weights, turned = weights_of(slope, slip, anisotropy)
    tables = np.where(within, _from_tables(WITHIN, seems, slope), _from_tables(BEYOND, seems, slope))
    return np.asarray(turned * (weights[1:] * tables).sum(axis=0))


def weights_of(slope: FloatArray, slip: FloatArray, anisotropy: float) -> tuple[FloatArray, FloatArray]:
    """Weights [6, k] of the tables for edges by the slope there and the direction of slip, both [2, k]; and 1, or −1
    where the grid, as the tables have it, is seen in a mirror [k].

    The part of first order in the ``anisotropy`` η goes with cos 2φ and sin 2φ, as the response to traction does, φ the
    angle of slip to the slope, that of second order with 1, cos 4φ and sin 4φ.
    """
    turned = np.where(slope[0] * slope[1] * (np.abs(slope[0]) - np.abs(slope[1])) < 0.0, -1.0, 1.0)
    twice, one = 2.0 * (np.arctan2(slip[1], slip[0]) - np.arctan2(slope[1], slope[0])), np.ones_like(turned)
    first = (anisotropy * np.cos(twice), anisotropy * turned * np.sin(twice))
    second = (anisotropy**2 * one, anisotropy**2 * np.cos(2.0 * twice), anisotropy**2 * turned * np.sin(2.0 * twice))
    return np.stack((one, *first, *second)), turned


def _from_tables(which: slice, seems: FloatArray, slope: FloatArray) -> FloatArray:
    """Values [tables, k] by how far cells seem to be from an edge, in cells, and by the slope there [2, k]."""
    tables, far, (flat, steep) = _tables()[which], np.sqrt(np.abs(seems)), np.sort(np.abs(slope), axis=0)
    row = np.minimum(far / EDGES.table_reach, 1.0) * (tables.shape[1] - 1)
    column = np.arctan2(flat, steep) * (tables.shape[2] - 1) / (np.pi / 4.0)
    places = np.broadcast_arrays(np.arange(len(tables))[:, None], row, column)
    found = map_coordinates(tables, places, order=1, mode="nearest")
    return np.asarray(found * np.minimum(1.0, EDGES.table_reach / np.maximum(far, EDGES.table_reach)) ** 2)


@cache
def _tables() -> FloatArray:
    """Tables [16, rows, columns] by the root of how far cells seem to be from an edge, in even steps, and by its angle
    from 0 to 45°: six of the excess, five of what is across slip within an edge, and as many beyond.
    """
    return np.loadtxt(str(files("slipcore.contact.tiers") / "edge_cells.csv"), delimiter=",").reshape(16, -1, 9)
