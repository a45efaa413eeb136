"""The equations of one load step: normal contact, tangential contact, and what ties them together."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from slipcore.contact.errors import NotConverged
from slipcore.contact.grid import Box, Grid, bounding_box
from slipcore.contact.normal import NormalContact, solve_normal
from slipcore.contact.operator import Operators
from slipcore.contact.problem import Problem, StepLoad
from slipcore.contact.tangential import TangentialContact, solve_tangential
from slipcore.errors import InvalidInput
from slipcore.frames import FloatArray

BOX_MULTIPLE = 4
"""Boxes grow by so many cells, so that a growing contact meets few new operators."""
OUTER_ITERATIONS = 60
"""Of coupling and of velocity-dependent friction."""


class StepSolution(NamedTuple):
    """``normal`` contact on the whole grid; ``tangential`` contact and ``limit`` μp Pa on its ``box`` (without contact
    the whole grid); ``iterations``: Newton steps in all.
    """

    normal: NormalContact
    tangential: TangentialContact
    limit: FloatArray
    box: Box
    iterations: int


@dataclass(frozen=True, slots=True, eq=False)
class StepEquations:
    """What is given in one step; fields on the whole grid.

    ``height`` [ny, nx] m, with what creep recalls; ``friction`` [ny, nx]; ``offset`` [2, ny, nx] m: what the surface
    has moved since the last step apart from traction and pressure; ``tolerance`` of tractions, as a share of the
    largest limit.
    """

    problem: Problem
    grid: Grid
    operators: Operators
    height: FloatArray
    friction: FloatArray
    offset: FloatArray
    load: StepLoad
    tolerance: float
    normal_tolerance: float

    def solve(self, pressure: FloatArray, traction: FloatArray) -> StepSolution:
        """Pressure and traction that agree with each other, from guesses of both on the whole grid."""
        solution = self._once(pressure, traction, self.height)
        if not self.problem.coupled:
            return solution
        iterations = solution.iterations
        for _ in range(OUTER_ITERATIONS):
            if not solution.normal.pressure.any():
                return solution
            before, traction = solution.normal.pressure, self._whole(solution)
            lifted = self.height + self.operators.on(self.grid).normal_by_traction(traction)
            solution = self._once(before, traction, lifted)
            iterations += solution.iterations
            change = float(np.abs(solution.normal.pressure - before).max() / before.max())
            if change <= self.tolerance:
                return solution._replace(iterations=iterations)
        raise NotConverged("normal-tangential coupling", change, self.tolerance, OUTER_ITERATIONS)

    def _whole(self, solution: StepSolution) -> FloatArray:
        whole = np.zeros((2, *self.grid.shape))
        whole[:, *solution.box] = solution.tangential.traction
        return whole

    def _once(self, pressure: FloatArray, traction: FloatArray, height: FloatArray) -> StepSolution:
        """Normal contact, then tangential contact under its pressure."""
        normal = solve_normal(
            self.operators,
            self.grid,
            height,
            self.load.normal_force,
            self.load.approach,
            self.normal_tolerance,
            pressure,
        )
        touching = normal.pressure > 0.0
        box = bounding_box(touching if touching.any() else ~touching, BOX_MULTIPLE)
        offset = self.offset
        if self.problem.coupled or self.problem.spread:
            offset = offset + self.operators.on(self.grid).tangential_by_pressure(normal.pressure)
        return self._slide(normal, box, offset[:, *box], traction[:, *box])

    def _slide(self, normal: NormalContact, box: Box, offset: FloatArray, start: FloatArray) -> StepSolution:
        """Tangential contact; again with new limits as long as friction depends on the velocity that comes out."""
        pressure, coefficient = normal.pressure[box], self.friction[box]
        for law in self.problem.pressure_laws:
            coefficient = coefficient + law(pressure)
        limit = _coulomb_limit(coefficient, pressure)
        if not self.problem.velocity_laws:
            tangential = self._tangential(box, limit, offset, start)
            return StepSolution(normal, tangential, limit, box, tangential.iterations)
        iterations, velocity = 0, np.zeros_like(pressure)
        for k in range(OUTER_ITERATIONS):
            added = [law(velocity) for law in self.problem.velocity_laws]
            before, limit = limit, _coulomb_limit(sum(added, start=coefficient), pressure)
            tangential = self._tangential(box, limit, offset, start)
            iterations += tangential.iterations
            change = float(np.abs(limit - before).max()) / max(float(limit.max()), 1e-300)
            if change <= self.tolerance and k > 0:
                return StepSolution(normal, tangential, limit, box, iterations)
            start, velocity = tangential.traction, np.hypot(*tangential.slip) / self.load.duration
        raise NotConverged("velocity-dependent friction", change, self.tolerance, OUTER_ITERATIONS)

    def _tangential(self, box: Box, limit: FloatArray, offset: FloatArray, start: FloatArray) -> TangentialContact:
        part = self.grid.part(box)
        operator = self.operators.on(part)
        return solve_tangential(operator, part.points(), limit, offset, self.load.control(), start, self.tolerance)


def _coulomb_limit(coefficient: FloatArray, pressure: FloatArray) -> FloatArray:
    """μp where the coefficient is positive."""
    if not np.isfinite(coefficient).all():
        raise InvalidInput("friction coefficient", "not finite at some pressure or velocity", "finite in all contacts")
    return np.maximum(coefficient, 0.0) * pressure
