"""The equations of one load step: normal contact, tangential contact, and what ties them together."""

from collections import deque
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from slipcore.contact.defaults import STEP, TINY
from slipcore.contact.elasticity.fields import inner, largest, lengths, rigid_displacement
from slipcore.contact.elasticity.grid import Box, Grid, bounding_box, on_whole
from slipcore.contact.elasticity.operator import Operators
from slipcore.contact.errors import NotConverged
from slipcore.contact.solver.extrapolation import Stress
from slipcore.contact.solver.normal import NormalContact, solve_normal
from slipcore.contact.solver.problem import ContactProblem, StepLoad
from slipcore.contact.solver.tangential import TangentialContact, solve_tangential
from slipcore.errors import InvalidInput
from slipcore.frames import FloatArray


class Mixing:
    """Anderson's acceleration of a fixed point (J. ACM 12 (1965) 547): of the last points that combination is taken
    which the map would change least if it were linear.
    """

    def __init__(self) -> None:
        self._last = deque[tuple[FloatArray, FloatArray]](maxlen=STEP.mixing_depth + 1)

    def next(self, point: FloatArray, mapped: FloatArray) -> FloatArray:
        """The next point, given the last and what the map made of it."""
        self._last.append((mapped - point, mapped))
        *earlier, (change, _) = self._last
        bends = [change - before for before, _ in earlier]
        following = mapped
        for share, (_, before) in zip(_least_squares(bends, change), earlier, strict=True):
            following = following - share * (mapped - before)
        return following


def _least_squares(columns: list[FloatArray], right: FloatArray) -> FloatArray:
    """Shares of the columns that add up to the right side as nearly as can be; columns alike count as one."""
    products = np.array([[inner(a, b) for b in columns] for a in columns]).reshape(len(columns), len(columns))
    sizes = np.sqrt(products.diagonal())
    sizes = np.where(sizes > 0.0, sizes, 1.0)
    along = np.array([inner(column, right) for column in columns])
    return np.asarray(np.linalg.pinv(products / np.outer(sizes, sizes), STEP.mixing_rank) @ (along / sizes) / sizes)


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
    has moved since the last step apart from traction and pressure; ``speed`` [ny, nx] m/s: a guess of how fast it
    slips; ``tolerance`` of tractions, as a share of the
    largest limit; ``known``: normal contact where it is that of the last step.
    """

    problem: ContactProblem
    grid: Grid
    operators: Operators
    height: FloatArray
    friction: FloatArray
    offset: FloatArray
    speed: FloatArray
    load: StepLoad
    tolerance: float
    normal_tolerance: float
    known: NormalContact | None = None

    def solve(self, guess: Stress) -> StepSolution:
        """Pressure and traction that agree with each other, from a guess of both on the whole grid."""
        pressure, traction, _ = guess
        if not self.problem.coupled:
            return self._once(pressure, traction, self.height, self.tolerance)
        lift, change, iterations, mixing = self._lift(traction), STEP.coupling_start, 0, Mixing()
        goal = max(self.tolerance, STEP.inexact * change)
        for _ in range(STEP.outer_iterations):
            solution = self._once(pressure, traction, self.height + lift, goal)
            pressure, traction = solution.normal.pressure, self._whole(solution)
            iterations += solution.iterations
            if not pressure.any():
                return solution
            if solution.iterations == 0 and goal > self.tolerance:  # too coarse to show what this lift leads to
                goal = max(self.tolerance, STEP.inexact * goal)
                continue
            mapped = self._lift(traction)
            change = STEP.pressure_by_lift * float(np.abs(mapped - lift).max() / solution.normal.displacement.max())
            if max(STEP.coupling_margin * change, goal) <= self.tolerance:
                return solution._replace(iterations=iterations)
            lift, goal = mixing.next(lift, mapped), max(self.tolerance, STEP.inexact * change)
        raise NotConverged("normal-tangential coupling", change, self.tolerance, STEP.outer_iterations)

    def pressed(self, guess: Stress) -> NormalContact:
        """Normal contact under a guess of the traction: where cells touch, and all of it where nothing is coupled."""
        lift = self._lift(guess.traction) if self.problem.coupled else 0.0
        return self._normal(guess.pressure, self.height + lift, self.tolerance)

    def gap(self, solution: StepSolution) -> FloatArray:
        """Gap [ny, nx] m that a solution of these equations leaves, or of equations with less contact."""
        normal = solution.normal
        lift = self._lift(self._whole(solution)) if self.problem.coupled else 0.0
        return self.height + lift + normal.displacement - normal.approach

    def slip(self, solution: StepSolution) -> FloatArray:
        """Motion [2, ny, nx] m against the object in this step of all cells, whether they touch or not."""
        operator, points = self.operators.on(self.grid), np.stack(self.grid.points())
        moved = self.offset + operator.tangential(self._whole(solution))
        if self.problem.coupled or self.problem.spread:
            moved = moved + operator.tangential_by_pressure(solution.normal.pressure)
        return moved - rigid_displacement(points, solution.tangential.motion)

    def stress(self, solution: StepSolution) -> Stress:
        """Stresses of a solution on the whole grid."""
        limit = on_whole(self.grid, solution.box, solution.limit)
        return Stress(solution.normal.pressure, self._whole(solution), limit)

    def _lift(self, traction: FloatArray) -> FloatArray:
        return self.operators.on(self.grid).normal_by_traction(traction)

    def _whole(self, solution: StepSolution) -> FloatArray:
        return on_whole(self.grid, solution.box, solution.tangential.traction)

    def _normal(self, pressure: FloatArray, height: FloatArray, tolerance: float) -> NormalContact:
        return self.known or solve_normal(
            self.operators,
            self.grid,
            height,
            self.load.normal_force,
            self.load.approach,
            self.normal_tolerance * tolerance / self.tolerance,
            pressure,
        )

    def _once(self, pressure: FloatArray, traction: FloatArray, height: FloatArray, tolerance: float) -> StepSolution:
        """Normal contact, then tangential contact under its pressure."""
        normal = self._normal(pressure, height, tolerance)
        touching = normal.pressure > 0.0
        box = bounding_box(touching if touching.any() else ~touching, STEP.box_multiple)
        offset = self.offset
        if self.problem.coupled or self.problem.spread:
            offset = offset + self.operators.on(self.grid).tangential_by_pressure(normal.pressure)
        return self._slide(normal, box, offset[:, *box], traction[:, *box], tolerance)

    def _slide(
        self, normal: NormalContact, box: Box, offset: FloatArray, start: FloatArray, tolerance: float
    ) -> StepSolution:
        """Tangential contact; again with new limits as long as friction depends on the velocity that comes out."""
        pressure, coefficient = normal.pressure[box], self.friction[box]
        for law in self.problem.pressure_laws:
            coefficient = coefficient + law(pressure)
        if not self.problem.velocity_laws:
            limit = _coulomb_limit(coefficient, pressure)
            tangential = self._tangential(box, limit, offset, start, tolerance)
            return StepSolution(normal, tangential, limit, box, tangential.iterations)
        iterations, speed, mixing = 0, self.speed[box], Mixing()
        for _ in range(STEP.outer_iterations):
            limit = self._limit(coefficient, speed, pressure)
            tangential = self._tangential(box, limit, offset, start, tolerance)
            iterations += tangential.iterations
            mapped = lengths(tangential.slip) / self.load.duration
            off = np.abs(self._limit(coefficient, mapped, pressure) - limit)
            change = float(off.max()) / max(float(limit.max()), TINY)
            if change <= tolerance:
                return StepSolution(normal, tangential, limit, box, iterations)
            start, speed = tangential.traction, np.maximum(mixing.next(speed, mapped), 0.0)
        raise NotConverged("velocity-dependent friction", change, tolerance, STEP.outer_iterations)

    def _limit(self, coefficient: FloatArray, speed: FloatArray, pressure: FloatArray) -> FloatArray:
        """μp at a slip speed."""
        added = [law(speed) for law in self.problem.velocity_laws]
        return _coulomb_limit(sum(added, start=coefficient), pressure)

    def _tangential(
        self, box: Box, limit: FloatArray, offset: FloatArray, start: FloatArray, tolerance: float
    ) -> TangentialContact:
        part = self.grid.part(box)
        operator = self.operators.on(part)
        return solve_tangential(operator, part.points(), limit, offset, self.load.control(), start, tolerance)


def _coulomb_limit(coefficient: FloatArray, pressure: FloatArray) -> FloatArray:
    """μp where the coefficient is positive."""
    if not np.isfinite(largest(np.ascontiguousarray(coefficient))):
        raise InvalidInput("friction coefficient", "not finite at some pressure or velocity", "finite in all contacts")
    return np.maximum(coefficient, 0.0) * pressure
