"""Slip rates of second order in load steps.

Traction is opposite to the rate of slip at the end of a step. That the slip s of the whole step stands for it (backward
Euler) is right to first order only, where the direction of slip turns. Backward differences over two steps make it
proportional to s − c s′, with s′ the slip of the step before, c = w²/(1 + 2w) and w the ratio of the steps' durations.
So the step's equations stay what they are, with c s′ counted as made already where a cell goes on slipping.

Where slip ends or turns back within the step, and where the rate of a load jumps, there is no rate to go on with: there
the step is done by backward Euler, whose error in single steps is of second order, too, but where slip ends at once, as
other cells touch (``touching.py``).
"""

from dataclasses import replace

import numpy as np

from slipcore.contact.defaults import STEP
from slipcore.contact.solver.extrapolation import Stress
from slipcore.contact.solver.step_equations import StepEquations, StepSolution
from slipcore.frames import FloatArray


def carried_share(before: FloatArray, rate: FloatArray, ratio: float) -> float:
    """c above; 0 where one of the loads' rates [n], in 1/s, is not that of the step ``before``, or where the step is
    much longer than that (``ratio`` of durations).
    """
    steady = np.abs(rate - before) <= STEP.steady * np.maximum(np.abs(rate), np.abs(before))
    return ratio**2 / (1.0 + 2.0 * ratio) if steady.all() and ratio <= STEP.longest_step else 0.0


def solve_carrying(equations: StepEquations, carried: FloatArray, made: FloatArray, guess: Stress) -> StepSolution:
    """The solution of a step's equations with the slip c s′ ``carried`` over [2, ny, nx] m from the step before and,
    where slip ends, with what is ``made`` [2, ny, nx] m of it until then.
    """
    if not (carried.any() or made.any()):
        return equations.solve(guess)
    may_end = np.any((carried != 0.0) | (made != 0.0), axis=0)
    while True:
        solution = replace(equations, offset=equations.offset - carried).solve(guess)
        tangential, here = solution.tangential, carried[:, *solution.box]
        if tangential.sliding and all(equations.load.given) and carried.any():
            return equations.solve(guess)  # the load does not show how far a sliding contact moves
        ends = may_end[solution.box] & (~tangential.slides | ((tangential.slip * here).sum(axis=0) < 0.0))
        if not ends.any():
            return solution._replace(tangential=tangential._replace(slip=tangential.slip + here))
        carried, may_end, guess = carried.copy(), may_end.copy(), equations.stress(solution)
        carried[:, *solution.box] = np.where(ends, made[:, *solution.box], here)
        may_end[solution.box] &= ~ends
