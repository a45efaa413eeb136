"""Paths of load on a sphere for the hard cases, each step held to balance, Coulomb's law and complementarity."""

from collections.abc import Iterable

import numpy as np

from slipcore.contact.elasticity.grid import Grid
from slipcore.contact.elasticity.influence import HalfSpace
from slipcore.contact.solver.problem import ContactProblem, StepLoad
from slipcore.contact.solver.quasi_static import QuasiStatic
from slipcore.contact.solver.state import StepResult

YOUNG, RADIUS, FORCE, FRICTION = 1e6, 15e-3, 10.0, 0.4
SLIDING = FRICTION * FORCE
BOUND = 20
"""Newton steps a load step at a tolerance of 1e-8; an uncoupled step that needs more has a fault."""


def bowl(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    return (x**2 + y**2) / (2.0 * RADIUS)


def body(poisson: float = 0.3, young: float = YOUNG) -> HalfSpace:
    return HalfSpace.from_young(young, poisson)


def problem(poisson: float = 0.3, friction: float = FRICTION, height=bowl, **more) -> ContactProblem:
    return ContactProblem((body(poisson),), friction, heights=(height,), **more)


def at(normal: float, along_x: float = 0.0, along_y: float = 0.0, moment: float = 0.0) -> StepLoad:
    return StepLoad(normal, tangential=np.array([along_x, along_y, moment]))


def moved(normal: float, *motion: float) -> StepLoad:
    return StepLoad(normal, motion=np.array(motion), given=(False, False, False))


def follow(
    scene: ContactProblem,
    loads: Iterable[StepLoad],
    cells: int = 32,
    width: float = 11e-3,
    bound: int = BOUND,
    tolerance: float = 1e-8,
) -> list[StepResult]:
    """All results on a square grid, after holding each to what ``follow_on`` asks."""
    return follow_on(Grid.square(cells, width), scene, loads, bound, tolerance)


def follow_on(
    grid: Grid, scene: ContactProblem, loads: Iterable[StepLoad], bound: int = BOUND, tolerance: float = 1e-8
) -> list[StepResult]:
    """All results, after holding each to bound, balance, Coulomb's law and complementarity; at rates of slip of second
    order, as scenes are run.
    """
    solver = QuasiStatic(scene, grid, tolerance, 1e-9, second_order=True)
    results = list(solver.run(loads))
    before, touched = np.zeros((2, *grid.shape)), np.zeros(grid.shape, dtype=bool)
    for result in results:
        assert result.iterations <= bound
        assert result.imbalance <= 1e-10
        assert result.residual <= tolerance
        assert result.normal_residual <= 1e-9
        assert np.isfinite(result.displacement).all()
        assert complementarity(result, solver.friction, before, touched) <= 10.0 * tolerance
        before, touched = result.slip, result.contact
    return results


def complementarity(result: StepResult, friction: np.ndarray, before: np.ndarray, touched: np.ndarray) -> float:
    """The larger of how far a cell is over its limit and what power friction leaves untaken, both as shares.

    Traction is opposite to the rate of slip at the step's end: in a cell that goes on slipping in steps as long as the
    last, that is s - s'/3, with the slip s' of the step ``before``; else that of the step, and none in a cell that
    sticks from when others touch that had not ``touched`` before.
    """
    limit = friction * result.force[2]
    largest, carried = float(limit.max()), float((friction * result.contact).max()) * abs(result.approach)
    if largest == 0.0:
        return float(np.abs(result.force[:2]).max())
    size, slip = np.hypot(*result.force[:2]), np.hypot(*result.slip)
    going_on, stepped = (untaken(result, limit, rate) for rate in (result.slip - before / 3.0, result.slip))
    ended = touched & (size < 0.999 * limit) & (result.contact & ~touched).any()
    power = float(np.where(ended, 0.0, np.minimum(going_on, stepped)).max())
    return max(float((size - limit).max()) / largest, power / (largest * max(carried, slip.max())))


def untaken(result: StepResult, limit: np.ndarray, rate: np.ndarray) -> np.ndarray:
    """Power of each cell that tractions opposite to a rate of slip would take, and these do not."""
    return np.abs((result.force[:2] * rate).sum(axis=0) + limit * np.hypot(*rate))
