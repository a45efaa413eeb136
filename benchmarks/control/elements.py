"""The world of closed loops on boundary elements, for one finger: what the reduced one is audited against.

As ``slipcore.contact.reduced``, by ``init``, ``step``, ``observe`` and ``stick_ratio``. The object is at rest in each
frame as long as friction carries its load. What friction does not carry moves it: then its motion is prescribed from
one short step to the next, and follows from the forces that the contact had.
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from slipcore.contact.elasticity.grid import Grid
from slipcore.contact.elasticity.influence import HalfSpace
from slipcore.contact.reduced import Load, World
from slipcore.contact.solver.macro_slip import FreeObject
from slipcore.contact.solver.problem import ContactProblem, StepLoad
from slipcore.contact.solver.quasi_static import QuasiStatic
from slipcore.contact.solver.state import ContactState, StepResult
from slipcore.contact.tiers.sampling import SensorGrid, frame_record
from slipcore.errors import InvalidInput
from slipcore.frames import FloatArray, Frame

CELLS = 3
"""Of the solver's grid along an element, so that a contact under 2 N is 21 cells wide."""
TOLERANCE = 1e-3
"""Of tractions, as a share of what a step changes."""


class ElementsState(NamedTuple):
    """The world between two frames: its ``contact`` and the step's ``result`` before it, and by how much the contact's
    middle slid, ``offset`` [2] m.
    """

    time: float
    normal_force: FloatArray
    contact: ContactState
    result: StepResult
    offset: FloatArray

    @property
    def slipped(self) -> FloatArray:
        """How far the middle of the contact has slipped, [1] m."""
        return np.array([np.hypot(*self.offset)])


class _Solver(NamedTuple):
    quasi_static: QuasiStatic
    sensor: SensorGrid


def init(world: World, normal_force: float) -> ElementsState:
    """The finger at rest on the object, pressed with ``normal_force`` N, without load."""
    if len(world.friction) != 1:
        raise InvalidInput("world", f"{len(world.friction)} fingers", "one finger")
    solver = _solver(world).quasi_static
    contact, result = solver.step(solver.start(), StepLoad(normal_force))
    return ElementsState(0.0, np.array([normal_force]), contact, result, np.zeros(2))


def step(world: World, state: ElementsState, command: FloatArray, load: Load, duration: float) -> ElementsState:
    """The world ``duration`` s later, as ``reduced.step`` has it."""
    normal = _pressed(world, state, command, duration)
    asked = StepLoad(float(normal[0]), tangential=np.asarray(load.resultant()), duration=duration)
    free = FreeObject(load.mass, world.gyration)
    contact, result = _solver(world).quasi_static.step(state.contact, asked, free)
    y, x = (size // 2 for size in _solver(world).sensor.grid.shape)
    offset = state.offset + result.slip[:, y, x]
    return ElementsState(state.time + duration, normal, contact, result, offset)


def _pressed(world: World, state: ElementsState, command: FloatArray, duration: float) -> FloatArray:
    """The gripper's force after it has followed its command for a while, [1] N."""
    return np.asarray(command + (state.normal_force - command) * np.exp(-duration / world.gripper_lag))


def observe(world: World, state: ElementsState, finger: int = 0, generator: np.random.Generator | None = None) -> Frame:
    """What the finger's sensor sees, as ``reduced.observe`` has it."""
    assert finger == 0
    seen = frame_record(_solver(world).sensor, [state.result])
    displacement, force = seen.displacement, seen.force
    if generator is not None:
        displacement = displacement + world.marker_noise * generator.standard_normal(displacement.shape)
        force = force + world.force_noise * generator.standard_normal(force.shape)
    return Frame(state.time, displacement, force, None, world.normal)


def stick_ratio(world: World, state: ElementsState, finger: int = 0) -> float:  # noqa: ARG001
    """True share of the contact that does not slip."""
    return state.result.stick_ratio


@lru_cache(maxsize=4)
def _solver(world: World) -> _Solver:
    """The contact on a grid whose cells divide the sensor's elements; friction is an element's."""
    n, m = world.sampling.points
    pitch = world.sampling.pitch
    grid = Grid((m * CELLS, n * CELLS), (pitch / CELLS, pitch / CELLS))
    friction = world.friction[0]

    def of_element(x: FloatArray, y: FloatArray) -> FloatArray:
        row, column = (np.floor(place / pitch + 0.5 * count) for place, count in ((x, n), (y, m)))
        return friction[row.astype(int), column.astype(int)]

    finger = world.finger
    body = HalfSpace.from_young(finger.young_modulus, finger.poisson_ratio)
    problem = ContactProblem((body,), 0.0, heights=(finger.height(),), friction_fields=(of_element,))
    solver = QuasiStatic(problem, grid, TOLERANCE, 1e-2 * TOLERANCE, second_order=True)
    return _Solver(solver, SensorGrid(grid, world.sampling.points, CELLS))
