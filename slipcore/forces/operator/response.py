"""Displacement of markers by traction on the surface: the forward operator."""

from collections.abc import Mapping, Sequence
from functools import lru_cache
from types import MappingProxyType

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates, spline_filter

from slipcore.contact.elasticity.bonded_layer import LayerBase
from slipcore.contact.elasticity.grid import Grid
from slipcore.contact.elasticity.influence import ElasticBody, HalfSpace
from slipcore.contact.elasticity.interior import Below, Interior
from slipcore.contact.elasticity.operator import ElasticOperator
from slipcore.forces.defaults import RESPONSE
from slipcore.forces.operator.gel import Gel
from slipcore.forces.operator.nodes import Nodes
from slipcore.forces.operator.uneven import UnevenLayer
from slipcore.frames import FloatArray

ODD_X, ODD_Y = frozenset({"xy", "zx", "xz"}), frozenset({"xy", "zy", "yz"})
"""Components that change their sign with x, and with y."""


def response_matrix(gel: Gel, nodes: Nodes, position: FloatArray, uneven: UnevenLayer | None = None) -> FloatArray:
    """Displacement of markers by traction on the nodes' hat functions: [3, j, 3, k] m/Pa.

    ``position`` [j, 2] m: markers at rest, at the gel's ``marker_depth``. Directions are x, y and *into* the gel, of
    displacement first and of traction (x, y, pressure) last. Normal and tangential directions are coupled. ``uneven``:
    the gel under these markers, if it is so.
    """
    return response_matrices(gel, nodes.grid.pitch[0], [nodes.places()], position, uneven=uneven)[0]


def response_matrices(
    gel: Gel,
    pitch: float,
    nodes: Sequence[FloatArray],
    position: FloatArray,
    axes: Sequence[int] = (0, 1, 2),
    uneven: UnevenLayer | None = None,
) -> list[FloatArray]:
    """``response_matrix`` of several sets of ``nodes`` [k, 2] m, whose hat functions have the half-width ``pitch`` m,
    and of displacement along some ``axes`` alone. Raises ``InvalidInput`` for a gel that is too thin beside these.
    """
    gel.check_beside(pitch)
    if uneven is None:
        return _of_a_layer(gel, pitch, nodes, position, axes)
    whole = uneven.responses(gel, nodes, lambda alike: _of_a_layer(alike, pitch, nodes, position, (0, 1, 2)))
    return [each[list(axes)] for each in whole]


def _of_a_layer(
    gel: Gel, pitch: float, nodes: Sequence[FloatArray], position: FloatArray, axes: Sequence[int]
) -> list[FloatArray]:
    """Of one that is alike everywhere."""
    cells, finer = RESPONSE.cells, RESPONSE.finer
    offsets, places = zip(*(_offsets(position, each, pitch / cells) for each in nodes), strict=True)
    close = RESPONSE.near * cells
    farthest = int(np.ceil(max(np.abs(offset).max() for offset in offsets)))
    reach = max(farthest + 3, close)  # a cubic spline ends three cells beyond
    matrices = [np.empty((len(axes), len(position), 3, len(each))) for each in nodes]
    for component, spline in _splines(gel, pitch, cells, finer, close, reach).items():
        directions = [(axes.index(to), by) for to, by in _directions(component) if to in axes]
        if not directions:
            continue
        for matrix, offset, place in zip(matrices, offsets, places, strict=True):
            value = map_coordinates(spline, (offset + reach).T[::-1], order=3, mode="mirror", prefilter=False)[place]
            for to, by in directions:
                matrix[to, :, by] = value
    return matrices


@lru_cache(maxsize=2)  # logs of one sensor ask for the same, and 1 to 7 MB
def _splines(gel: Gel, pitch: float, cells: int, finer: int, close: int, reach: int) -> Mapping[Below, FloatArray]:
    """``hat_responses`` at offsets of up to ``reach`` cells, by ``finer`` ones up to ``close``, as cubic splines."""
    far, near = hat_responses(gel, pitch, cells, reach), hat_responses(gel, pitch, cells * finer, close * finer, finer)
    middle = (slice(reach - close, reach + close + 1),) * 2
    for component, table in far.items():
        table[middle] = near[component]
        far[component] = spline_filter(table, order=3, mode="mirror")
        far[component].flags.writeable = False
    return MappingProxyType(far)


def _offsets(position: FloatArray, places: FloatArray, cell: float) -> tuple[FloatArray, NDArray[np.intp]]:
    """How far markers [j, 2] m lie from nodes at ``places`` [k, 2] m, each offset [d, 2] once, in cells, and which of
    them a pair has, [j, k]: on a lattice most are alike.
    """
    apart = (position[:, None, :] - places[None]).reshape(-1, 2) / cell
    alike = np.round(apart, RESPONSE.digits) @ np.array([1.0, 1.0j])
    _, first, which = np.unique(alike, return_index=True, return_inverse=True)
    return apart[first], which.reshape(len(position), len(places))


def hat_responses(gel: Gel, pitch: float, cells: int, reach: int, step: int = 1) -> dict[Below, FloatArray]:
    """Displacements (m) by 1 Pa on a hat function of half-width ``pitch``, made of so many cells a pitch.

    At offsets of up to ``reach`` cells along y and x from its centre, from one end in steps of so many cells: each
    [n, n], n = 2 reach / step + 1.
    """
    side = reach + cells + 1
    kernels = cell_responses(gel, Grid((side, side), (pitch / cells, pitch / cells)))
    return {component: _by_hats(_mirrored(kernel, component), cells, step) for component, kernel in kernels.items()}


def cell_responses(gel: Gel, grid: Grid) -> dict[Below, FloatArray]:
    """Displacements (m) by 1 Pa on one cell at the first quadrant's offsets, by the contact simulator's kernels.

    Of a square of square cells, on which y is x turned.
    """
    if gel.marker_depth > 0.0:
        return Interior(gel.young_modulus, gel.poisson_ratio, gel.thickness, gel.marker_depth).influences(grid)
    bodies: list[ElasticBody] = [HalfSpace.from_young(gel.young_modulus, gel.poisson_ratio)]
    if np.isfinite(gel.thickness):
        bodies.append(LayerBase(gel.thickness, gel.young_modulus, gel.poisson_ratio))
    operator = ElasticOperator(tuple(bodies), grid)
    surface: dict[Below, FloatArray] = {}
    for component in ("nn", "xx", "xy", "zx"):
        kernel = operator.influence(component)
        surface[component] = np.zeros(grid.shape) if kernel is None else kernel
    surface |= {"yy": surface["xx"].T, "zy": surface["zx"].T}
    return surface | {"xz": -surface["zx"], "yz": -surface["zy"]}


def _directions(component: Below) -> tuple[tuple[int, int], ...]:
    """Directions of displacement and of traction that a component couples."""
    to, by = ("xyz".index(letter) for letter in component.replace("n", "z"))
    return ((to, by), (by, to)) if component == "xy" else ((to, by),)


def _mirrored(quadrant: FloatArray, component: Below) -> FloatArray:
    """Kernel at all offsets, [2 ny − 1, 2 nx − 1]."""
    left = quadrant[:, :0:-1] * (-1.0 if component in ODD_X else 1.0)
    half = np.concatenate((left, quadrant), axis=1)
    return np.concatenate((half[:0:-1] * (-1.0 if component in ODD_Y else 1.0), half))


def _by_hats(kernel: FloatArray, cells: int, step: int) -> FloatArray:
    """Response to a hat function of ``cells`` cells half-width, from that to one cell, in steps of so many cells;
    without the cells it reaches.
    """
    weight = 1.0 - np.abs(np.arange(-cells, cells + 1)) / cells
    weight[cells] -= 0.25 / cells  # means of the hat over the cell in its middle
    weight[[0, -1]] = 1.0 / (8.0 * cells)  # and over those at its foot
    for _ in range(2):
        kernel = sliding_window_view(kernel, len(weight), axis=0)[::step] @ weight
        kernel = kernel.T
    return np.ascontiguousarray(kernel)
