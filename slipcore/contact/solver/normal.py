"""Frictionless normal contact of elastic bodies with any gap between them.

    minimise ½ pᵀKp + pᵀ(height − approach)   over p ≥ 0 [, Σp A = F]

Active sets, each relaxed by a few conjugate gradients and clipped, with projected gradients as a safeguard; from
coarse grids to fine ones, each on the contact's own box. On the finest grid the contact is then nearly known.
"""

from collections import deque
from typing import NamedTuple

import numpy as np

from slipcore.compilation import compiled
from slipcore.contact.defaults import NORMAL, TINY
from slipcore.contact.elasticity.fields import doubled, inner
from slipcore.contact.elasticity.grid import Box, Grid, bounding_box
from slipcore.contact.elasticity.operator import ElasticOperator, Operators
from slipcore.contact.errors import NotConverged
from slipcore.errors import InvalidInput
from slipcore.frames import BoolArray, FloatArray


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
        relaxed = _Relaxation(operators.on(part), height[box], force, approach).solve(start[box], tolerance, most)
        pressure = np.zeros(grid.shape)
        pressure[box] = relaxed.pressure
        displacement = relaxed.displacement if part.shape == grid.shape else operators.on(grid).normal(pressure)
        gap = height + displacement - relaxed.approach
        depth = relaxed.approach - float(height.min())
        missed = gap < -max(tolerance, relaxed.residual) * depth
        missed[box] = False
        if not missed.any():
            total = float(pressure.sum()) * grid.cell_area
            return NormalContact(
                pressure, displacement, gap, relaxed.approach, total, relaxed.residual, relaxed.iterations
            )
        inside, start = missed | (pressure > 0.0), pressure


def _with_margin(box: Box, shape: tuple[int, int]) -> Box:
    """The box with room around it, of even size where there is room for that."""

    def span(part: slice, size: int) -> slice:
        first, last = max(part.start - NORMAL.margin, 0), min(part.stop + NORMAL.margin, size)
        return slice(first, last + ((last - first) % 2 and last < size))

    return span(box[0], shape[0]), span(box[1], shape[1])


class _Relaxed(NamedTuple):
    pressure: FloatArray
    displacement: FloatArray
    approach: float
    residual: float
    iterations: int


class _Relaxation:
    """Active sets on one box."""

    def __init__(
        self, operator: ElasticOperator, height: FloatArray, force: float | None, approach: float | None
    ) -> None:
        self.operator, self.height, self.approach = operator, height, approach
        self.total = None if force is None else force / operator.grid.cell_area
        self.lowest = float(height.min())
        self.reachable = np.where(np.isfinite(height), height, 0.0)

    def solve(self, pressure: FloatArray, tolerance: float, max_iterations: int) -> _Relaxed:
        pressure = self._feasible(pressure)
        displacement = self.operator.normal(pressure)
        energies = deque([self._energy(pressure, displacement)], NORMAL.memory)
        residual = np.inf
        for iteration in range(max_iterations):
            gap, approach = self._gap(displacement, pressure)
            loaded = pressure > 0.0
            worst = max(float(np.abs(gap[loaded]).max(initial=0.0)), -float(gap.min()))
            residual = worst / max(approach - self.lowest, TINY)
            if residual <= tolerance and approach > self.lowest:
                return _Relaxed(pressure, displacement, approach, residual, iteration)
            change, response = self._relax(loaded | (gap < 0.0), gap)
            trial = self._feasible(pressure + change)
            if (pressure + change < 0.0).any():
                response = self.operator.normal(trial - pressure)
            moved = displacement + response
            if self._energy(trial, moved) > max(energies) + NORMAL.energy_rounding * abs(max(energies)):
                trial, moved = self._descend(pressure, displacement, gap, approach)
            pressure, displacement = trial, moved
            energies.append(self._energy(pressure, displacement))
        raise NotConverged("normal contact", residual, tolerance, max_iterations)

    def _energy(self, pressure: FloatArray, displacement: FloatArray) -> float:
        """The objective; it need only not climb above its last few values, or active sets could not change freely."""
        shift = 0.0 if self.approach is None else self.approach
        return 0.5 * inner(pressure, displacement) + inner(pressure, self.reachable - shift)

    def _gap(self, displacement: FloatArray, pressure: FloatArray) -> tuple[FloatArray, float]:
        """Gap [ny, nx] and approach; under a given force that which closes the gap on average over the contact."""
        shape = displacement + self.height
        approach = float(shape[pressure > 0.0].mean()) if self.approach is None else self.approach
        return shape - approach, approach

    def _feasible(self, pressure: FloatArray) -> FloatArray:
        clipped = np.maximum(pressure, 0.0)
        if self.total is None:
            return clipped
        if not clipped.any():
            clipped = np.where(self.height <= self.lowest, 1.0, 0.0)  # an empty contact would never fill again
        return clipped * (self.total / float(clipped.sum()))

    def _relax(self, active: BoolArray, gap: FloatArray) -> tuple[FloatArray, FloatArray]:
        """A change of pressure that closes the gap on the active cells, at the same total force if that is given, and
        its displacement, by conjugate gradients.
        """
        inverse = self.operator.normal_inverse
        residual = self._balanced(gap.copy(), active)
        change, response = np.zeros_like(gap), np.zeros_like(gap)
        improved = self._balanced(inverse(residual), active)
        direction = -improved
        size = first = inner(residual, improved)
        for _ in range(NORMAL.iterations):
            if size <= 0.0:
                break
            image = self.operator.normal(direction)
            _advance(change, response, residual, direction, image, size / inner(direction, image))
            self._balanced(residual, active)
            improved = self._balanced(inverse(residual), active)
            before, size = size, inner(residual, improved)
            if size <= NORMAL.reduction**2 * first:
                break
            direction *= size / before
            direction -= improved
        return change, response

    def _balanced(self, field: FloatArray, active: BoolArray) -> FloatArray:
        """The part of a field that is on the active cells and, under a given force, sums to zero; in place."""
        _restrict(field, active, self.total is not None)
        return field

    def _descend(
        self, pressure: FloatArray, displacement: FloatArray, gap: FloatArray, approach: float
    ) -> tuple[FloatArray, FloatArray]:
        """A projected gradient step at the contact's own mean stiffness, with an exact line search."""
        loaded = pressure > 0.0
        stiffness = float(pressure[loaded].mean()) / (approach - self.lowest) if loaded.any() else 1.0
        way = self._feasible(pressure - stiffness * np.where(loaded | (gap < 0.0), gap, 0.0)) - pressure
        response = self.operator.normal(way)
        curvature = inner(way, response)
        slope = inner(np.where(way != 0.0, gap, 0.0), way)
        share = min(max(-slope / curvature, 0.0), 1.0) if curvature > 0.0 else 0.0
        return pressure + share * way, displacement + share * response


@compiled
def _restrict(field: FloatArray, active: BoolArray, balanced: bool) -> None:
    """Zero a field [ny, nx] outside the active cells and, if ``balanced``, make it sum to zero on them; in place."""
    total, count = 0.0, 0
    for i in range(field.shape[0]):
        for j in range(field.shape[1]):
            if active[i, j]:
                total += field[i, j]
                count += 1
            else:
                field[i, j] = 0.0
    if balanced and count:
        mean = total / count
        for i in range(field.shape[0]):
            for j in range(field.shape[1]):
                if active[i, j]:
                    field[i, j] -= mean


@compiled
def _advance(
    change: FloatArray,
    response: FloatArray,
    residual: FloatArray,
    direction: FloatArray,
    image: FloatArray,
    step: float,
) -> None:
    """One conjugate-gradient step in place; ``image``: the operator on ``direction``."""
    for i in range(change.shape[0]):
        for j in range(change.shape[1]):
            change[i, j] += step * direction[i, j]
            response[i, j] += step * image[i, j]
            residual[i, j] += step * image[i, j]
