"""Where a cell is when it touches within a load step.

Only what a cell moves against the object from touch on can be slip. If its motion from the step's begin counted, its
traction would be wrong in proportion to the step, and stay so as long as the cell sticks: the solution would be of
first order in the steps.

How a cell moves before it touches follows from the step's own equations with all cells barred that did not touch
before. Gap and motion are taken to change in proportion to each other, so that a cell whose gap would go from g to −d
has made g/(g + d) of that motion when it touches: the whole of it where loads grow in proportion (F_T ∝ F_N).

A cell that slips beside it may stick from then on. Its slip until then stays, likewise that share of its slip with the
new cells barred, and would be lost, in proportion to the step, if it counted as one that stuck in all of the step.
"""

from dataclasses import replace

import numpy as np

from slipcore.contact.defaults import STEP
from slipcore.contact.errors import InfeasibleLoad
from slipcore.contact.solver.extrapolation import Stress
from slipcore.contact.solver.normal import NormalContact
from slipcore.contact.solver.step_equations import StepEquations, StepSolution
from slipcore.frames import BoolArray, FloatArray


def from_touch(
    equations: StepEquations, last: NormalContact, guess: Stress
) -> tuple[StepEquations, Stress, FloatArray]:
    """The equations of a step with the motion of cells that touch in it counted from where they touch, a nearer guess
    of the stresses, and the slip [2, ny, nx] m of other cells until the first touch.

    ``last``: normal contact at the end of the step before; ``guess`` of the stresses at the end of this one. Where no
    cell comes to touch, or all do, these are the equations as they were, and there is no slip.
    """
    touched, none = last.pressure > 0.0, np.zeros_like(equations.offset)
    if equations.known is not None or not touched.any():
        return equations, guess, none
    normal = equations.pressed(guess)
    guess = guess._replace(pressure=normal.pressure)
    if not equations.problem.coupled:
        equations = replace(equations, known=normal)
    if not (normal.pressure[~touched] > 0.0).any():
        return equations, guess, none
    barred = _barring(equations, ~touched)
    try:
        solution = barred.solve(guess._replace(pressure=np.where(touched, guess.pressure, 0.0)))
    except InfeasibleLoad:  # only the new cells let the contact bear the load
        return equations, guess, none
    share = _share_before_touch(equations, solution, touched, last.gap)
    moved = np.where(touched, 0.0, share * equations.slip(solution))
    guess = guess._replace(traction=barred.stress(solution).traction)
    return replace(equations, offset=equations.offset - moved), guess, _slip_before_touch(solution, share)


def _barring(equations: StepEquations, cells: BoolArray) -> StepEquations:
    """The equations with cells that cannot touch."""
    return replace(
        equations,
        height=np.where(cells, np.inf, equations.height),
        tolerance=STEP.barred_tolerance * equations.tolerance,
        normal_tolerance=STEP.barred_tolerance * equations.normal_tolerance,
        known=None,
    )


def _share_before_touch(
    equations: StepEquations, solution: StepSolution, touched: BoolArray, gap: FloatArray
) -> FloatArray:
    """Share [ny, nx] of its motion in the step that each cell makes until it touches, 1 where it does not or is
    ``touched`` already; ``gap`` [ny, nx] m at the begin.
    """
    end = equations.gap(solution)
    closes = ~touched & (end < 0.0)
    return np.divide(gap, gap - end, out=np.ones_like(gap), where=closes).clip(min=0.0)


def _slip_before_touch(solution: StepSolution, share: FloatArray) -> FloatArray:
    """Slip [2, ny, nx] m of each cell until the first one touches."""
    slip, tangential = np.zeros((2, *share.shape)), solution.tangential
    slip[:, *solution.box] = np.where(tangential.slides & (solution.limit > 0.0), share.min() * tangential.slip, 0.0)
    return slip
