"""Contact through a sequence of load steps: press, shear, twist, reverse, release.

``start`` gives the state of bodies apart, ``step`` the next state and what happened on the way.
"""

import math
import time
from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np

from slipcore.contact.defaults import STEP, TINY
from slipcore.contact.elasticity.fields import lengths
from slipcore.contact.elasticity.grid import Grid, bounding_box, on_whole
from slipcore.contact.elasticity.influence import Scaled
from slipcore.contact.elasticity.operator import Count, Operators
from slipcore.contact.solver.creep import creep_compliance, creep_recalled, creep_step
from slipcore.contact.solver.extrapolation import Stress, continuation, extrapolated
from slipcore.contact.solver.macro_slip import FreeObject, moving
from slipcore.contact.solver.problem import ContactProblem, StepLoad
from slipcore.contact.solver.slip_rate import carried_share, solve_carrying
from slipcore.contact.solver.state import ContactState, StepResult
from slipcore.contact.solver.step_equations import StepEquations, StepSolution
from slipcore.contact.solver.touching import from_touch
from slipcore.frames import FloatArray

__all__ = ["ContactState", "QuasiStatic", "StepResult"]


class QuasiStatic:
    """A contact problem on a grid. Steps change nothing but the kept operators.

    ``tolerance`` on tractions is relative to what the step can change, so that slip rates hold too;
    ``normal_tolerance`` on the gap is relative to the indentation. ``second_order`` takes rates of slip from two steps
    where loads go on at the same rate, by the steps' durations; without it each step is one of backward Euler.
    """

    def __init__(
        self,
        problem: ContactProblem,
        grid: Grid,
        tolerance: float = STEP.tolerance,
        normal_tolerance: float = STEP.normal_tolerance,
        *,
        second_order: bool = False,
    ) -> None:
        self.problem, self.grid = problem, grid
        # Friction that depends on velocity takes the mean velocity of a step.
        self.second_order = second_order and not problem.velocity_laws
        self.tolerance, self.normal_tolerance = tolerance, normal_tolerance
        self.height, self.friction = problem.height(grid), problem.static_friction(grid)
        self.count = Count()
        self.finger = Operators(problem.finger, self.count, grid)
        self._relaxed: dict[float, Operators] = {}

    def start(self) -> ContactState:
        """Bodies apart."""
        zero = np.zeros((3, *self.grid.shape))
        creep = tuple(zero for _ in self.problem.creep)
        apart, still, at_rest = Stress(zero[0], zero[:2], zero[0]), np.zeros(3), np.zeros(4)
        return ContactState(
            None, apart, apart, zero[:2], zero, creep, still, zero[0], zero[:2], StepLoad(0.0), still, at_rest
        )

    def run(self, loads: Iterable[StepLoad]) -> Iterator[StepResult]:
        """Results of loads one after the other, from bodies apart."""
        state = self.start()
        for load in loads:
            state, result = self.step(state, load)
            yield result

    def step(
        self, state: ContactState, load: StepLoad, free: FreeObject | None = None
    ) -> tuple[ContactState, StepResult]:
        """The next state and what happened; raises ``InfeasibleLoad``, ``NotConverged`` and ``InvalidInput``.

        ``free``: the object, where what friction does not carry shall move it instead of being refused.
        """
        began, counted = time.perf_counter(), replace(self.count)
        if free is None:
            after, result = self._balanced(state, load)
        else:
            after, result = moving(self._balanced, self.grid, state, load, free)
        seconds = time.perf_counter() - began
        return after, replace(result, applications=self.count.since(counted), seconds=seconds)

    def _balanced(self, state: ContactState, load: StepLoad) -> tuple[ContactState, StepResult]:
        """The same for an object at rest, or one whose motion is given."""
        recalled = creep_recalled(self.problem.creep, state.creep, state.elastic, load.duration)
        drive = _drive(state.load, load)
        equations = StepEquations(
            self.problem,
            self.grid,
            self._operators(load.duration),
            self.height if recalled is None else self.height + recalled[2],
            self.friction,
            -state.displacement if recalled is None else recalled[:2] - state.displacement,
            state.speed,
            load,
            self.tolerance * self._share(state, load, drive),
            self.normal_tolerance,
            state.normal if self._pressed_alike(state, load) else None,
        )
        guess = extrapolated(state.stress, state.before, continuation(state.drive, drive))
        made = np.zeros_like(state.slip)
        if state.normal is not None and self._moves_sideways(drive):
            equations, guess, made = from_touch(equations, state.normal, guess)
        solution = solve_carrying(equations, self._carried(state, load, drive), made, guess)
        after = self._advance(equations, state, load, drive, solution, recalled)
        return after, self._result(equations, state, after, solution)

    def _pressed_alike(self, state: ContactState, load: StepLoad) -> bool:
        """Whether nothing that pressure depends on has changed since the last step."""
        pressed = (load.normal_force, load.approach) == (state.load.normal_force, state.load.approach)
        return pressed and not self.problem.coupled and not self.problem.creep

    def _carried(self, state: ContactState, load: StepLoad, drive: FloatArray) -> FloatArray:
        """Slip [2, ny, nx] m of the last step that goes on in this one, for rates of slip of second order."""
        if not self.second_order:
            return np.zeros_like(state.slip)
        share = carried_share(state.rate, _rate(state.load, load, drive), load.duration / state.load.duration)
        return share * state.slip

    def _moves_sideways(self, drive: FloatArray) -> bool:
        """Whether cells that do not touch may move against the object in a step."""
        return bool(drive.any() or self.problem.coupled or self.problem.spread or self.problem.creep)

    def _operators(self, duration: float) -> Operators:
        """Compliance of both bodies together within a step of this duration."""
        softening = creep_compliance(self.problem.creep, duration)
        if softening not in self._relaxed:
            finger = self.problem.finger
            if softening != 1.0:
                finger = tuple(Scaled(body, softening) for body in finger)
            self._relaxed[softening] = Operators((*finger, *self.problem.obstacle), self.count, self.grid)
        return self._relaxed[softening]

    def _share(self, state: ContactState, load: StepLoad, drive: FloatArray) -> float:
        """How much of the contact's capacity the step can change: what its tolerance is measured by."""
        before, now = state.load.normal_force, load.normal_force
        if before is None or now is None or now == 0.0 or not all(load.given):
            return max(STEP.least_share, STEP.unknown_share)
        capacity = float(self.friction.max()) * now
        shear = float(np.hypot(drive[0], drive[1]))
        if drive[2] != 0.0:
            shear += abs(drive[2]) / _lever(state.stress.pressure, self.grid)
        return min(max(abs(now - before) / now, shear / max(capacity, TINY), STEP.least_share), 1.0)

    def _advance(
        self,
        equations: StepEquations,
        state: ContactState,
        load: StepLoad,
        drive: FloatArray,
        solution: StepSolution,
        recalled: FloatArray | None,
    ) -> ContactState:
        """The state at the end of the step."""
        stress = equations.stress(solution)
        pressure, traction, _ = stress
        both = self._displacement(equations.operators, pressure, traction, solution)
        alone = equations.operators.bodies == self.finger.bodies
        elastic = both if alone else self._displacement(self.finger, pressure, traction)
        displacement = both[:2]
        creep = creep_step(self.problem.creep, state.creep, state.elastic, elastic, load.duration)
        if recalled is not None:
            displacement = displacement + recalled[:2]
        speed = state.speed
        if self.problem.velocity_laws:
            speed = on_whole(self.grid, solution.box, lengths(solution.tangential.slip) / load.duration)
        return ContactState(
            normal=solution.normal,
            stress=stress,
            before=state.stress,
            displacement=displacement,
            elastic=elastic,
            creep=creep,
            pose=state.pose + solution.tangential.motion,
            speed=speed,
            slip=self._slid(state, solution),
            load=load,
            drive=drive,
            rate=_rate(state.load, load, drive),
        )

    def _slid(self, state: ContactState, solution: StepSolution) -> FloatArray:
        """Slip [2, ny, nx] m of the cells that touched at the step's begin and slide at its end."""
        tangential, box = solution.tangential, solution.box
        sliding = tangential.slides & (solution.limit > 0.0) & (state.stress.pressure[box] > 0.0)
        return on_whole(self.grid, box, np.where(sliding, tangential.slip, 0.0))

    def _displacement(
        self, operators: Operators, pressure: FloatArray, traction: FloatArray, known: StepSolution | None = None
    ) -> FloatArray:
        """Displacement [3, ny, nx] m on the whole grid by pressure and traction, as far as not ``known`` already."""
        operator = operators.on(self.grid)
        whole = np.zeros((3, *self.grid.shape))
        if pressure.any():
            whole[2] = operator.normal(pressure) if known is None else known.normal.displacement
            if traction.any():
                everywhere = known is not None and known.limit.shape == self.grid.shape
                whole[:2] = known.tangential.displacement if known and everywhere else operator.tangential(traction)
            if self.problem.coupled:
                whole[2] += operator.normal_by_traction(traction)
            if self.problem.coupled or self.problem.spread:
                whole[:2] += operator.tangential_by_pressure(pressure)
        return whole

    def _result(
        self, equations: StepEquations, state: ContactState, after: ContactState, solution: StepSolution
    ) -> StepResult:
        normal, tangential, box = solution.normal, solution.tangential, solution.box
        contact, force = normal.pressure > 0.0, np.empty((3, *self.grid.shape))
        touching = contact[box]
        slip = np.where(touching, tangential.slip, 0.0)
        at_limit = touching & (lengths(tangential.traction) >= (1.0 - STEP.at_limit) * solution.limit)
        moved = lengths(slip) > self._noticeable(equations, solution, after.pose - state.pose)
        np.multiply(after.stress.traction, self.grid.cell_area, out=force[:2])
        np.multiply(after.stress.pressure, self.grid.cell_area, out=force[2])
        return StepResult(
            displacement=sum(after.creep, start=after.elastic.copy()),
            force=force,
            limit=after.stress.limit * self.grid.cell_area,
            slip=on_whole(self.grid, box, slip),
            contact=contact,
            at_limit=on_whole(self.grid, box, at_limit),
            moved=on_whole(self.grid, box, moved),
            pose=after.pose.copy(),
            approach=normal.approach,
            sliding=tangential.sliding and bool(contact.any()),
            residual=tangential.residual,
            normal_residual=normal.residual,
            imbalance=tangential.imbalance,
            iterations=solution.iterations,
            applications=Count(),
            seconds=0.0,
        )

    def _noticeable(self, equations: StepEquations, solution: StepSolution, motion: FloatArray) -> float:
        """Slip m above which a cell moves against the object: a share of the object's motion, and more than solver
        noise.
        """
        (rows, columns), (dx, dy, turn) = solution.box, motion.tolist()
        x, y = (places[[0, -1]].tolist() for places in (self.grid.x[columns], self.grid.y[rows]))
        carried = max(math.hypot(dx - turn * b, dy + turn * a) for a in x for b in y)  # the corners
        kernel = equations.operators.on(self.grid).influence("xx")
        compliance = 0.0 if kernel is None else float(kernel[0, 0])
        return max(STEP.moved * carried, STEP.noise * equations.tolerance * float(solution.limit.max()) * compliance)


def _drive(before: StepLoad, load: StepLoad) -> FloatArray:
    """By how much the step changes what drives the object: load where that is given, otherwise motion [3]."""
    return np.where(load.given, load.tangential - before.tangential, load.motion)


def _rate(before: StepLoad, load: StepLoad, drive: FloatArray) -> FloatArray:
    """Rates [4] 1/s at which the step changes pressing (force or approach) and what drives the object; none by
    rounding.
    """
    if before.normal_force is not None and load.normal_force is not None:
        pressed, change = load.normal_force, load.normal_force - before.normal_force
    else:
        pressed, change = load.approach or 0.0, (load.approach or 0.0) - (before.approach or 0.0)
    changes, sizes = np.array([change, *drive]), np.abs([pressed, *load.tangential])
    steady = np.abs(changes) <= STEP.rounding * sizes
    changes[steady] = 0.0
    return changes / load.duration


def _lever(pressure: FloatArray, grid: Grid) -> float:
    """Half the extent of the contact, m; the grid's where there is none yet."""
    touching = pressure > 0.0
    rows, columns = (part.stop - part.start for part in bounding_box(touching if touching.any() else ~touching))
    return 0.5 * float(max((columns - 1) * grid.pitch[0], (rows - 1) * grid.pitch[1], min(grid.pitch)))
