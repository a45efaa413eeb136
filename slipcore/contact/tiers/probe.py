"""What a coarse grid shows of the contact under the largest normal force, before anything is simulated."""

from dataclasses import dataclass

import numpy as np

from slipcore.contact.defaults import PROBE
from slipcore.contact.elasticity.grid import Grid
from slipcore.contact.elasticity.influence import Scaled
from slipcore.contact.elasticity.operator import Operators
from slipcore.contact.plan.plan import Plan
from slipcore.contact.solver.normal import solve_normal
from slipcore.contact.solver.problem import ContactProblem
from slipcore.errors import InvalidInput
from slipcore.frames import FloatArray


@dataclass(frozen=True, slots=True)
class ContactProbe:
    """``reach``: how far the contact extends from the centre along x or y, m; ``friction``: the force that makes it
    slide over the normal force; ``lever``: the moment that does over that force, m. None of the last two without
    contact.
    """

    reach: float
    friction: float = 0.0
    lever: float = 0.0


def contact_reach(plan: Plan) -> float:
    """How far the contact extends from the centre along x or y under the largest normal force, m."""
    return probe(plan).reach


def probe(plan: Plan) -> ContactProbe:
    """The contact under the largest normal force; raises ``InvalidInput`` where it has no end."""
    problem = plan.problem
    force = plan.largest_force()
    softening = 1.0 + sum(branch.strength for branch in problem.creep)
    operators = Operators((*(Scaled(body, softening) for body in problem.finger), *problem.obstacle))
    reach = PROBE.first_reach
    if force <= 0.0:
        return ContactProbe(reach)
    for _ in range(PROBE.tries):
        grid = Grid.square(PROBE.cells, 2.0 * reach)
        try:
            height = problem.height(grid)
            pressure = solve_normal(operators, grid, height, force=force, tolerance=PROBE.tolerance).pressure
        except InvalidInput:  # no surface within reach yet
            reach *= 2.0
            continue
        x, y = grid.points()
        touching = pressure > 0.0
        extent = float(np.maximum(np.abs(x), np.abs(y))[touching].max()) + 0.5 * grid.pitch[0]
        if extent > PROBE.fills * reach:
            reach *= 2.0
        elif extent < PROBE.least * reach:
            reach = PROBE.shrink * extent
        else:
            return ContactProbe(extent, *_sliding(problem, grid, pressure))
    raise InvalidInput("contact", f"reaches beyond {reach:.3g} m", "surfaces that part within some metres")


def _sliding(problem: ContactProblem, grid: Grid, pressure: FloatArray) -> tuple[float, float]:
    """The force that makes a contact slide over the normal force, and the moment about the centre over that force."""
    friction = sum((law(pressure) for law in problem.pressure_laws), start=problem.static_friction(grid))
    limit = np.maximum(friction, 0.0) * pressure
    force, moment = float(limit.sum()), float((limit * np.hypot(*grid.points())).sum())
    return force / float(pressure.sum()), moment / force if force > 0.0 else 0.0
