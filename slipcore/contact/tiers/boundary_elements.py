"""The boundary-element tier: a plan, a fidelity, a log."""

import time
from dataclasses import dataclass
from itertools import pairwise

from slipcore.contact.defaults import FIDELITY, PROBE
from slipcore.contact.plan.entries import check_own_types
from slipcore.contact.plan.plan import Plan
from slipcore.contact.progress import Progress, no_progress
from slipcore.contact.solver.quasi_static import QuasiStatic
from slipcore.contact.solver.resolution import summary
from slipcore.contact.solver.state import StepResult
from slipcore.contact.tiers.free_grid import FreeSensorGrid, free_grid
from slipcore.contact.tiers.load_steps import LoadSteps
from slipcore.contact.tiers.probe import ContactProbe, probe
from slipcore.contact.tiers.sampling import (
    FrameRecord,
    SensorGrid,
    frame_record,
    frame_times,
    grasp_log,
    sensor_grid,
    untouched,
)
from slipcore.errors import InvalidInput
from slipcore.frames import FloatArray, GraspLog


@dataclass(frozen=True, slots=True)
class Fidelity:
    """``cells`` across the largest contact, load steps a frame (``substeps``), ``tolerance`` of the solver.

    There are more load steps where an edge would move too far in one: where pressing moves the surface sideways the
    contact becomes wider by a cell at most, or by a ``substeps``-th of it, and the edge of stick moves no farther.

    ``aligned``: cells are so small a part of a sensor element, an odd one, that points are cell centres, and there may
    be more of them than ``cells``; the truth at a point is then exact, and the stick ratio counts cells. Otherwise
    there are as many as said: displacement is interpolated, forces are shared by area, a point is what the cell around
    it is, and the stick ratio is that of areas within their fronts. Without a sensor every cell is a point.
    """

    cells: int = FIDELITY.cells
    substeps: int = FIDELITY.substeps
    tolerance: float = FIDELITY.tolerance
    aligned: bool = True

    def __post_init__(self) -> None:
        check_own_types(self)
        if self.cells < 4 or self.substeps < 1 or not 0.0 < self.tolerance < 1.0:
            raise InvalidInput("fidelity", self, "4 cells or more, 1 substep or more, a tolerance between 0 and 1")


def run(plan: Plan, fidelity: Fidelity | None = None, progress: Progress = no_progress) -> GraspLog:
    """Simulate a plan; the log has no observation effects yet. ``progress`` is called after each load step, with the
    part of them that is done.

    Raises ``InfeasibleLoad``, ``NotConverged`` and ``InvalidInput``.
    """
    fidelity = Fidelity() if fidelity is None else fidelity
    began = time.perf_counter()
    contact = probe(plan)
    where = grid_of(plan, fidelity, contact)
    gap_tolerance = FIDELITY.normal_share * fidelity.tolerance
    solver = QuasiStatic(plan.problem, where.grid, fidelity.tolerance, gap_tolerance, second_order=True)
    times = frame_times(plan)
    steps = LoadSteps(plan, contact)
    growth = step_growth(fidelity)
    instants = [steps.between(float(begin), float(end), fidelity.substeps, growth) for begin, end in pairwise(times)]
    frames, warnings = _frames(plan, solver, where, instants, progress)
    metadata = {
        "tier": "boundary elements",
        "grid": f"{where.grid.shape[1]} x {where.grid.shape[0]} cells of {where.grid.pitch[0]:.6g} m",
        "steps": str(len(warnings)),
        "tolerance": f"{fidelity.tolerance:g}",
        "unresolved": summary(warnings),
        "applications": str(solver.count.normal + solver.count.tangential + solver.count.coupling),
        "seconds": f"{time.perf_counter() - began:.3f}",
    }
    return grasp_log(plan, where, times, frames, metadata)


def grid_of(plan: Plan, fidelity: Fidelity, contact: ContactProbe) -> SensorGrid | FreeSensorGrid:
    """The grid of a run, with the sensor's points on it."""
    reach = PROBE.room * contact.reach
    if fidelity.aligned or plan.sampling is None:
        return sensor_grid(plan.sampling, reach, fidelity.cells)
    return free_grid(plan.sampling, reach, fidelity.cells)


def _frames(
    plan: Plan,
    solver: QuasiStatic,
    where: SensorGrid | FreeSensorGrid,
    steps: list[FloatArray],
    progress: Progress,
) -> tuple[list[FrameRecord], list[tuple[str, ...]]]:
    """Records of all frames, and of each load step what the grid does not resolve."""
    state, count = solver.start(), sum(len(instants) - 1 for instants in steps)
    frames, warnings = [untouched(where)], list[tuple[str, ...]]()
    for instants in steps:
        results: list[StepResult] = []
        for before, now in pairwise(instants):
            state, result = solver.step(state, plan.load(float(before), float(now)))
            results.append(result)
            warnings.append(result.warnings())
            progress(len(warnings) / count)
        frames.append(frame_record(where, results))
    return frames, warnings


def step_growth(fidelity: Fidelity) -> float:
    """By how much the contact becomes wider, or the edge of stick moves, in a step at most, as a share of the largest
    width.
    """
    return 1.0 / (fidelity.cells * fidelity.substeps)
