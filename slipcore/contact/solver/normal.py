"""Frictionless normal contact of elastic bodies with any gap between them.

    minimise ½ pᵀKp + pᵀ(height − approach)   over p ≥ 0 [, Σp A = F]

Active sets from coarse grids to fine ones, each on the contact's own box. On the finest grid the contact is then nearly
known.
"""

from typing import NamedTuple

import numpy as np

from slipcore.contact.defaults import NORMAL
from slipcore.contact.elasticity.fields import doubled
from slipcore.contact.elasticity.grid import Box, Grid, bounding_box
from slipcore.contact.elasticity.operator import ElasticOperator, Operators
from slipcore.contact.errors import NotConverged
from slipcore.contact.solver.active_sets import Relaxed, relaxed
from slipcore.errors import InvalidInput
from slipcore.frames import FloatArray


class NormalContact(NamedTuple):
    """``pressure`` Pa, ``displacement`` Kp m and ``gap`` m [ny, nx]; ``approach`` m; ``force`` N; ``residual``:
    largest |gap| under pressure or penetration elsewhere, as a share of the indentation; ``iterations``: active sets
    on the finest grid.
    """

    pressure: FloatArray
    displacement: FloatArray
    gap: FloatArray
    approach: float
    force: float
    residual: float
    iterations: int


def solve_normal(
    operators: Operators,
    grid: Grid,
    height: FloatArray,
    force: float | None = None,
    approach: float | None = None,
    tolerance: float = NORMAL.tolerance,
    start: FloatArray | None = None,
    max_iterations: int = NORMAL.active_sets,
) -> NormalContact:
    """Pressure under a given ``force`` (N) or at a given ``approach`` (m).

    ``height`` [ny, nx] m: gap between the undeformed bodies at approach zero, infinite where there is no surface;
    ``start``: a pressure from a similar contact. Raises ``InvalidInput``, and ``NotConverged`` at ``max_iterations``.
    """
    height = _checked(height, grid, force, approach)
    lowest = float(height.min())
    if force == 0.0 or (approach is not None and approach <= lowest):
        depth = lowest if approach is None else approach
        nothing = np.zeros(grid.shape)
        return NormalContact(nothing, nothing.copy(), height - depth, depth, 0.0, 0.0, 0)
    if start is None or not start.any():
        start = _from_coarse(operators, grid, height, force, approach, max_iterations)
    return _on_own_box(operators, grid, height, force, approach, tolerance, start, max_iterations)


def _checked(height: FloatArray, grid: Grid, force: float | None, approach: float | None) -> FloatArray:
    height = np.asarray(height, dtype=np.float64)
    if height.shape != grid.shape:
        raise InvalidInput("height", f"of shape {list(height.shape)}", f"shape {list(grid.shape)}")
    if np.isnan(height).any() or not np.isfinite(height.min()):
        raise InvalidInput("height", "NaN or nowhere finite", "numbers, infinite only where there is no surface")
    if (force is None) == (approach is None):
        raise InvalidInput("force and approach", f"{force} and {approach}", "exactly one of them")
    if force is not None and not 0.0 <= force < np.inf:
        raise InvalidInput("normal force", force, "finite and at least 0 N")
    if approach is not None and not np.isfinite(approach):
        raise InvalidInput("approach", approach, "finite")
    return height


def _from_coarse(
    operators: Operators, grid: Grid, height: FloatArray, force: float | None, approach: float | None, most: int
) -> FloatArray:
    """A first pressure, from a grid of half as many cells a side."""
    if min(grid.shape) < 2 * NORMAL.coarsest or grid.shape[0] % 2 or grid.shape[1] % 2:
        touching = np.isfinite(height)
        level = force / (touching.sum() * grid.cell_area) if force is not None else 0.0
        return np.where(touching, level, 0.0)
    half = Grid((grid.shape[0] // 2, grid.shape[1] // 2), (2.0 * grid.pitch[0], 2.0 * grid.pitch[1]), grid.centre)
    lower = _halved(height)
    start = _from_coarse(operators, half, lower, force, approach, most)
    coarse = _on_own_box(operators, half, lower, force, approach, NORMAL.coarse_tolerance, start, most).pressure
    fine = np.where(np.isfinite(height), doubled(coarse, grid.shape), 0.0)
    fine[fine < NORMAL.spread_edge * fine.max()] = 0.0  # interpolation has spread the edge
    return fine


def _halved(height: FloatArray) -> FloatArray:
    ny, nx = height.shape
    blocks = height.reshape(ny // 2, 2, nx // 2, 2)
    mean = blocks.mean(axis=(1, 3))
    return np.asarray(np.where(np.isfinite(mean), mean, blocks.min(axis=(1, 3))))


def _on_own_box(
    operators: Operators,
    grid: Grid,
    height: FloatArray,
    force: float | None,
    approach: float | None,
    tolerance: float,
    start: FloatArray,
    most: int,
) -> NormalContact:
    """Solve on the box of ``start``, and again on a larger one as long as bodies interpenetrate outside."""
    inside = start > 0.0
    if not inside.any():
        inside = np.isfinite(height)
    while True:
        box = _with_margin(bounding_box(inside), grid.shape)
        part = grid.part(box)
        found = _relax(operators.on(part), height[box], force, approach, tolerance, start[box], most)
        pressure = np.zeros(grid.shape)
        pressure[box] = found.pressure
        displacement = found.displacement if part.shape == grid.shape else operators.on(grid).normal(pressure)
        gap = height + displacement - found.approach
        depth = found.approach - float(height.min())
        missed = gap < -max(tolerance, found.residual) * depth
        missed[box] = False
        if not missed.any():
            total = float(pressure.sum()) * grid.cell_area
            return NormalContact(pressure, displacement, gap, found.approach, total, found.residual, found.iterations)
        inside, start = missed | (pressure > 0.0), pressure


def _with_margin(box: Box, shape: tuple[int, int]) -> Box:
    """The box with room around it, of even size where there is room for that."""

    def span(part: slice, size: int) -> slice:
        first, last = max(part.start - NORMAL.margin, 0), min(part.stop + NORMAL.margin, size)
        return slice(first, last + ((last - first) % 2 and last < size))

    return span(box[0], shape[0]), span(box[1], shape[1])


def _relax(
    operator: ElasticOperator,
    height: FloatArray,
    force: float | None,
    approach: float | None,
    tolerance: float,
    start: FloatArray,
    most: int,
) -> Relaxed:
    """Active sets on one box."""
    value = approach if force is None else force / operator.grid.cell_area
    assert value is not None
    found = relaxed(
        np.ascontiguousarray(start)[None],
        np.ascontiguousarray(height)[None],
        (force is not None, value, float(height.min())),
        (operator.normal_compiled, operator.normal_inverse.compiled),
        (tolerance, most, NORMAL.memory, NORMAL.energy_rounding),
        (NORMAL.reduction, NORMAL.iterations),
    )
    operator.count.normal += found.applications
    if found.iterations == most:
        raise NotConverged("normal contact", found.residual, tolerance, most)
    return found._replace(pressure=found.pressure[0], displacement=found.displacement[0])
