"""Where a cell is when it touches within a load step.

Only what a cell moves against the object from touch on can be slip. If its motion from the step's begin counted, its
traction would be wrong in proportion to the step, and stay so as long as the cell sticks: the solution would be of
first order in the steps.

How a cell moves before it touches follows from the step's own equations with all cells barred that did not touch
before. Gap and motion are taken to change in proportion to each other, so that a cell whose gap would go from g to −d
has made g/(g + d) of that motion when it touches: the whole of it where loads grow in proportion (F_T ∝ F_N).
"""

from dataclasses import replace

import numpy as np

from slipcore.contact.defaults import STEP
from slipcore.contact.errors import InfeasibleLoad
from slipcore.contact.solver.extrapolation import Stress
from slipcore.contact.solver.normal import NormalContact
from slipcore.contact.solver.step_equations import StepEquations, StepSolution
from slipcore.frames import BoolArray, FloatArray


def from_touch(equations: StepEquations, last: NormalContact, guess: Stress) -> tuple[StepEquations, Stress]:
    """The equations of a step with the motion of cells that touch in it counted from where they touch, and a nearer
    guess of the stresses.

    ``last``: normal contact at the end of the step before; ``guess`` of the stresses at the end of this one. Where no
    cell comes to touch, or all do, these are the equations as they were.
    """
    touched = last.pressure > 0.0
    if equations.known is not None or not touched.any():
        return equations, guess
    normal = equations.pressed(guess)
    guess = guess._replace(pressure=normal.pressure)
    if not equations.problem.coupled:
        equations = replace(equations, known=normal)
    if not (normal.pressure[~touched] > 0.0).any():
        return equations, guess
    barred = _barring(equations, ~touched)
    try:
        solution = barred.solve(guess._replace(pressure=np.where(touched, guess.pressure, 0.0)))
    except InfeasibleLoad:  # only the new cells let the contact bear the load
        return equations, guess
    moved = _moved_before_touch(equations, solution, touched, last.gap)
    guess = guess._replace(traction=barred.stress(solution).traction)
    return replace(equations, offset=equations.offset - moved), guess


def _barring(equations: StepEquations, cells: BoolArray) -> StepEquations:
    """The equations with cells that cannot touch."""
    return replace(
        equations,
        height=np.where(cells, np.inf, equations.height),
        tolerance=STEP.barred_tolerance * equations.tolerance,
        normal_tolerance=STEP.barred_tolerance * equations.normal_tolerance,
        known=None,
    )


def _moved_before_touch(
    equations: StepEquations, solution: StepSolution, touched: BoolArray, gap: FloatArray
) -> FloatArray:
    """Motion [2, ny, nx] m against the object of each cell from the step's begin to its touch, zero where ``touched``;
    ``gap`` [ny, nx] m at the begin.
    """
    end = equations.gap(solution)
    closes = ~touched & (end < 0.0)
    share = np.divide(gap, gap - end, out=np.ones_like(gap), where=closes)
    return np.where(touched, 0.0, share.clip(min=0.0) * equations.slip(solution))
