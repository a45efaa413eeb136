"""What friction does not carry moves the object: macro slip, from one short step to the next.

While friction carries the load the object is at rest in each step. Where it does not, the object's motion is prescribed
for a short step, and follows from what the contact bore before it (semi-implicit Euler); it ends where friction turns
the motion back.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from slipcore.contact.defaults import STEP
from slipcore.contact.elasticity.grid import Grid
from slipcore.contact.errors import InfeasibleLoad
from slipcore.contact.solver.problem import StepLoad
from slipcore.contact.solver.state import ContactState, StepResult
from slipcore.errors import InvalidInput
from slipcore.frames import FloatArray

Step = Callable[[ContactState, StepLoad], tuple[ContactState, StepResult]]
"""A step in which the object is at rest, or its motion prescribed; raises ``InfeasibleLoad`` where neither can be."""


@dataclass(frozen=True, slots=True)
class FreeObject:
    """An object of ``mass`` kg and radius of ``gyration`` m about the contact's normal, that load and friction move.

    ``damping`` N·s/m against all its motion, of which the moment is ``damping``·``gyration``²·ω.
    """

    mass: float
    gyration: float
    damping: float = 0.0

    def __post_init__(self) -> None:
        for name, least in (("mass", 0.0), ("gyration", 0.0), ("damping", None)):
            value = getattr(self, name)
            if not (value >= 0.0 if least is None else value > least) or not value < math.inf:
                raise InvalidInput(name, value, "finite, and at least 0" if least is None else "finite, and above 0")

    def velocity(self, before: FloatArray, surplus: FloatArray, duration: float) -> FloatArray:
        """Velocity [3] (m/s, m/s, 1/s) after ``surplus`` [3] (N, N, N·m) has acted; zero where it turns back."""
        unit = np.array([1.0, 1.0, self.gyration**2])
        after = (self.mass * unit * before + duration * surplus) / (unit * (self.mass + duration * self.damping))
        return after if before @ (unit * after) >= 0.0 else np.zeros(3)


def moving(
    step: Step, grid: Grid, state: ContactState, load: StepLoad, free: FreeObject
) -> tuple[ContactState, StepResult]:
    """The next state of a contact with a free object, and what happened in all of the step.

    Load and pressing change evenly within it where the object slides. Raises ``InvalidInput`` where motion is given.
    """
    if not all(load.given):
        raise InvalidInput("given", load.given, "loads alone for an object that moves by itself")
    begin, left, results = state, 1.0, []
    number = max(math.ceil(load.duration / STEP.sliding_step), 1)
    while left > 0.5 / number:
        if not state.velocity.any():
            try:
                state, result = step(state, replace(load, duration=left * load.duration))
            except InfeasibleLoad:
                pass
            else:
                results.append(result)
                break
        left -= 1.0 / number
        state, result = _slid(step, grid, state, _between(begin.load, load, 1.0 - left, number), free)
        results.append(result)
    return state, _together(results)


def _between(before: StepLoad, after: StepLoad, share: float, number: int) -> StepLoad:
    """The load within a step, of which a ``share`` is over, for one of ``number`` parts."""

    def at(first: float | None, last: float | None) -> float | None:
        return last if first is None or last is None else first + share * (last - first)

    return StepLoad(
        at(before.normal_force, after.normal_force),
        at(before.approach, after.approach) if after.normal_force is None else None,
        tangential=before.tangential + share * (after.tangential - before.tangential),
        duration=after.duration / number,
    )


def _slid(
    step: Step, grid: Grid, state: ContactState, load: StepLoad, free: FreeObject
) -> tuple[ContactState, StepResult]:
    """After a short step in which the object moves."""
    velocity = free.velocity(state.velocity, load.tangential - borne(grid, state), load.duration)
    asked = replace(load, motion=load.duration * velocity, given=(False, False, False))
    after, result = step(state if state.velocity.any() else _unlike(state), asked)
    after = replace(after, velocity=velocity, load=load)
    return after if velocity.any() else _unlike(after), result


def _unlike(state: ContactState) -> ContactState:
    """The same, of which nothing goes on: from load to motion, and back, rates are of different things."""
    return replace(state, drive=np.zeros(3), rate=np.zeros(4))


def borne(grid: Grid, state: ContactState) -> FloatArray:
    """Force and moment on the finger, [3] N, N, N·m."""
    x, y = grid.points()
    along, across = state.stress.traction * grid.cell_area
    return np.array([along.sum(), across.sum(), (x * across - y * along).sum()])


def _together(results: list[StepResult]) -> StepResult:
    """The last of some results in a row, with the slip and the iterations of all."""
    return replace(
        results[-1],
        slip=sum((result.slip for result in results[1:]), start=results[0].slip),
        moved=np.logical_or.reduce([result.moved for result in results]),
        iterations=sum(result.iterations for result in results),
    )
