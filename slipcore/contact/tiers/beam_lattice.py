"""The beam tier: the paper's virtual elastic beams ((17)–(26)), one a sensor element.

A beam bends under the traction on it and is tied to its four neighbours; a chain is a lattice one element wide. Bending
and ties are fitted to how far the elastic bodies themselves give way under the contact's own pressure, so that beams
stand for a half-space or a layer as well as local springs can: what far parts of a contact do to each other is lost.
Normal contact stays that of the bodies.
"""

from dataclasses import dataclass, replace

import numpy as np

from slipcore.contact.defaults import CHEAP_TIERS, PROBE
from slipcore.contact.elasticity.grid import Grid
from slipcore.contact.elasticity.influence import Component, ElasticBody
from slipcore.contact.elasticity.operator import Operators
from slipcore.contact.plan.description import SceneDescription
from slipcore.contact.plan.plan import Plan
from slipcore.contact.solver.normal import solve_normal
from slipcore.contact.tiers import boundary_elements
from slipcore.contact.tiers.boundary_elements import Fidelity
from slipcore.contact.tiers.probe import contact_reach
from slipcore.contact.tiers.sampling import sensor_grid
from slipcore.frames import FloatArray, GraspLog

NAME = "beams"
ONE_CELL_AN_ELEMENT = Fidelity(cells=CHEAP_TIERS.beam_cells)


@dataclass(frozen=True, slots=True)
class Beams:
    """Beams over ``bodies``, which keep their normal compliance: ``bending`` Pa/m, and ``tie`` N/m to each neighbour.

    The compliance of an endless lattice of pitch h is the inverse of bending + tie·(4 − 2cos κ_x h − 2cos κ_y h)/h²,
    from (17)–(20).
    """

    bodies: tuple[ElasticBody, ...]
    bending: float
    tie: float

    def influence(self, component: Component, grid: Grid) -> FloatArray | None:
        """Displacement (m) by 1 Pa on one cell at the offsets of the first quadrant [ny, nx]; None where it is zero."""
        if component == "nn":
            parts = [body.influence("nn", grid) for body in self.bodies]
            return np.asarray(np.sum([part for part in parts if part is not None], axis=0))
        if component in {"xy", "zx", "zy"}:
            return None
        ny, nx = grid.shape
        lengths = (CHEAP_TIERS.beam_room * n for n in (ny, nx))
        waves_y, waves_x = (2.0 - 2.0 * np.cos(2.0 * np.pi * np.fft.fftfreq(length)) for length in lengths)
        stiffness = self.bending + self.tie / grid.cell_area * (waves_y[:, None] + waves_x[None, :])
        return np.ascontiguousarray(np.fft.ifft2(1.0 / stiffness).real[:ny, :nx])


def accuracy(scene: SceneDescription, plan: Plan) -> float | None:  # noqa: ARG001 - as every tier is called
    """Largest error to expect; None for a scene with something that beams do not have."""
    problem = plan.problem
    lacking = (problem.obstacle, problem.creep, problem.coupled, problem.spread)
    return None if any(lacking) or plan.sampling is None else CHEAP_TIERS.beam_error


def run(scene: SceneDescription, plan: Plan) -> GraspLog:  # noqa: ARG001 - as every tier is called
    """Simulate a scene with beams in place of the bodies' tangential compliance."""
    beams = fitted(plan)
    problem = replace(plan.problem, finger=(beams,))
    log = boundary_elements.run(replace(plan, problem=problem), ONE_CELL_AN_ELEMENT)
    return replace(log, metadata={**log.metadata, "tier": NAME})


def fitted(plan: Plan) -> Beams:
    """Beams that carry, where the bodies would be under a traction like the pressure, as nearly that traction as they
    can (least squares over the contact at the largest normal force).
    """
    grid = sensor_grid(plan.sampling, PROBE.room * contact_reach(plan), ONE_CELL_AN_ELEMENT.cells).grid
    operators = Operators(plan.problem.finger)
    force = max(plan.value("normal_force", float(t)) for t in np.append(plan.corners(), plan.duration))
    height, tolerance = plan.problem.height(grid), CHEAP_TIERS.beam_tolerance
    pressure = solve_normal(operators, grid, height, force=force, tolerance=tolerance).pressure
    along_x = operators.on(grid).tangential(np.stack((pressure, np.zeros_like(pressure))))[0]
    along_y = operators.on(grid).tangential(np.stack((np.zeros_like(pressure), pressure)))[1]
    moved, touching = 0.5 * (along_x + along_y), pressure > 0.0
    pull = _to_neighbours(moved) / grid.cell_area
    responses = np.stack((moved[touching], pull[touching]), axis=1)
    scale = np.linalg.norm(responses, axis=0)
    bending, tie = np.linalg.lstsq(responses / scale, pressure[touching], rcond=None)[0] / scale
    return Beams(plan.problem.finger, float(bending), float(tie))


def _to_neighbours(field: FloatArray) -> FloatArray:
    """Σ (u − u_neighbour) over the four neighbours; beyond the grid the field goes on as at its edge."""
    around = np.pad(field, 1, mode="edge")
    others = around[:-2, 1:-1] + around[2:, 1:-1] + around[1:-1, :-2] + around[1:-1, 2:]
    return np.asarray(4.0 * field - others)
