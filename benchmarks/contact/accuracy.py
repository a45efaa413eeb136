"""What accuracy costs in time: `python -m benchmarks.contact.accuracy [--output FOLDER] [--cells ...] [--scenes ...]`.

Error against processor time over grids and tolerances, for each contact problem with a closed form and for whole
scenes against a fine run; then what `simulate(scene, accuracy=...)` was asked and what it kept; and the error of load
steps alone. `--parts steps` measures only the last. Writes JSON and pictures, prints Markdown tables.
"""

import argparse
import json
import statistics
import time
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter

from benchmarks.pages import save
from slipcore.contact import reference
from slipcore.contact.effects import LoadPath, SensorSampling, Viscoelasticity
from slipcore.contact.elasticity.grid import Grid
from slipcore.contact.elasticity.influence import HalfSpace
from slipcore.contact.elasticity.operator import Operators
from slipcore.contact.reference.mindlin_deresiewicz import MindlinDeresiewicz
from slipcore.contact.reference.torsion import TorsionPartialSlip, sliding_moment
from slipcore.contact.scene import Scene
from slipcore.contact.solver.normal import solve_normal
from slipcore.contact.solver.problem import ContactProblem, StepLoad
from slipcore.contact.solver.quasi_static import QuasiStatic
from slipcore.contact.solver.state import StepResult
from slipcore.contact.tiers.accuracy import difference, simulate_to
from slipcore.contact.tiers.boundary_elements import Fidelity, run
from slipcore.frames import FloatArray

FRICTION, RADIUS, FORCE, YOUNG = 0.4, 15e-3, 10.0, 1e6
HERTZ = reference.HertzContact(RADIUS, FORCE, reference.half_space(YOUNG, 0.0))
SLIDING = FRICTION * FORCE
WIDTH = 2.1
"""Of the grid, in contact radii."""
TOLERANCES = (1e-2, 1e-4, 1e-7)
REPEATS = 3
SCENES = (
    "table1_condition1",
    "table1_condition2",
    "table1_condition3",
    "table1_condition4",
    "table1_condition1_layer",
)
ASKED = (0.1, 0.05, 0.02)
FINE = Fidelity(cells=110, substeps=2, tolerance=1e-6)
CREEPING = Scene(
    "creeping pull",
    (
        Viscoelasticity((0.3,), (0.3,)),
        LoadPath((1.0, 1.5), force_x=(0.0, 2.0), force_y=(0.0, 1.0)),
        SensorSampling((12, 12), 1e-3, 10.0),
    ),
    duration=2.0,
)
"""Pressed, pulled and held, on a gel that creeps by 30 %, in 0.3 s."""
STEPPED = ("table1_condition1_layer", "bottle_cap_twist", "cup_filling", "lifting_07N", CREEPING.name)
STEPS = (1, 2, 4, 8)
FINEST_STEPS = 32
"""Load steps a frame that those of ``STEPS`` are compared with, on the same grid."""
PARTS = ("cells", "steps")

Errors = Callable[[int, float], float]


@dataclass(frozen=True, slots=True)
class Point:
    """One run: cells across the grid (of a scene: across the contact), tolerance, error, median processor seconds."""

    case: str
    cells: int
    tolerance: float
    error: float
    seconds: float


@dataclass(frozen=True, slots=True)
class Kept:
    """What was asked of ``simulate``, what it estimated, what was true, and what it took."""

    scene: str
    asked: float
    estimated: float
    true: float
    seconds: float


@dataclass(frozen=True, slots=True)
class Stepped:
    """What load steps alone leave of error in a scene: ``substeps`` a frame, ``steps`` in all, the largest absolute
    error of the stick ratio and its mean over time, relative L2 of displacement and force, processor seconds.
    """

    scene: str
    substeps: int
    steps: int
    stick_ratio: float
    mean_stick_ratio: float
    displacement: float
    force: float
    seconds: float


def relative(values: FloatArray, exact: FloatArray) -> float:
    """Relative L2 difference."""
    return float(np.sqrt(((values - exact) ** 2).sum() / (exact**2).sum()))


def hertz_grid(cells: int) -> Grid:
    """Grid around the contact."""
    return Grid.square(cells, WIDTH * HERTZ.contact_radius)


def sphere(poisson: float, *, coupled: bool = False) -> ContactProblem:
    """The paper's fingertip on a flat object."""
    heights = (lambda x, y: (x**2 + y**2) / (2.0 * RADIUS),)
    return ContactProblem((HalfSpace.from_young(YOUNG, poisson),), FRICTION, heights=heights, coupled=coupled)


def shear(along_x: float, moment: float = 0.0) -> StepLoad:
    """Full normal force and a tangential load."""
    return StepLoad(FORCE, tangential=np.array([along_x, 0.0, moment]))


def stepped(problem: ContactProblem, cells: int, tolerance: float, loads: list[StepLoad]) -> list[StepResult]:
    """Results of loads on a grid of that many cells a side."""
    grid = hertz_grid(cells)
    return list(QuasiStatic(problem, grid, tolerance, 1e-2 * tolerance).run(loads))


# Cases with a closed form: error of one run


def hertz(cells: int, tolerance: float) -> float:
    """Pressure of a sphere."""
    grid = hertz_grid(cells)
    x, y = grid.points()
    height = (x**2 + y**2) / (2.0 * RADIUS)
    operators = Operators((HalfSpace.from_young(YOUNG, 0.0),))
    solved = solve_normal(operators, grid, height, force=FORCE, tolerance=tolerance)
    return relative(solved.pressure, HERTZ.pressure(np.hypot(x, y)))


def cattaneo_mindlin(cells: int, tolerance: float) -> float:
    """Traction at F_T = 0.7 μF_N, ν = 0."""
    last = stepped(sphere(0.0), cells, tolerance, [shear(0.0), shear(0.7 * SLIDING)])[-1]
    grid = hertz_grid(cells)
    exact = reference.CattaneoMindlin(HERTZ, FRICTION, 0.7 * SLIDING).traction(np.hypot(*grid.points()))
    return relative(last.force[0] / grid.cell_area, exact)


def reversal(cells: int, tolerance: float) -> float:
    """Traction on a loop between ±0.9 μF_N, ν = 0; the largest error, of the traction at the peak."""
    forces = SLIDING * np.array([0.0, 0.5, 0.9, 0.4, 0.0, -0.5, -0.9, -0.3, 0.5, 0.9])
    grid = hertz_grid(cells)
    r = np.hypot(*grid.points())
    exact, errors = MindlinDeresiewicz(HERTZ, FRICTION), []
    peak = np.sqrt((exact.load(FORCE, 0.9 * SLIDING).traction(r) ** 2).sum())
    for force, result in zip(forces, stepped(sphere(0.0), cells, tolerance, [shear(f) for f in forces]), strict=True):
        exact = exact.load(FORCE, float(force))
        errors.append(np.sqrt(((result.force[0] / grid.cell_area - exact.traction(r)) ** 2).sum()) / peak)
    return float(max(errors))


def torsion(cells: int, tolerance: float) -> float:
    """Traction at 0.6 of the sliding moment."""
    moment = 0.6 * sliding_moment(HERTZ, FRICTION)
    last = stepped(sphere(0.0), cells, tolerance, [shear(0.0), shear(0.0, moment)])[-1]
    grid = hertz_grid(cells)
    x, y = grid.points()
    r = np.hypot(x, y)
    around = (x * last.force[1] - y * last.force[0]) / (np.where(r > 0.0, r, 1.0) * grid.cell_area)
    return relative(around, TorsionPartialSlip(HERTZ, FRICTION, moment).traction(r))


CLOSED: dict[str, Errors] = {
    "Hertz": hertz,
    "Cattaneo–Mindlin": cattaneo_mindlin,
    "unloading and reversal": reversal,
    "torsion": torsion,
}


def coupled_reference(cells: int) -> Errors:
    """Forces of a coupled contact at ν = 0.2 against a run on a grid of ``cells``, both summed over 16² elements."""

    def forces(count: int, tolerance: float) -> FloatArray:
        loads = [shear(0.0), *(shear(share * SLIDING) for share in (0.25, 0.5, 0.75))]
        last = stepped(sphere(0.2, coupled=True), count, tolerance, loads)[-1].force
        return last.reshape(3, 16, count // 16, 16, count // 16).sum(axis=(2, 4))

    fine = forces(cells, 1e-7)
    return lambda count, tolerance: relative(forces(count, tolerance), fine)


def timed(errors: Errors, cells: int, tolerance: float) -> tuple[float, float]:
    """Error and median processor seconds, set-up of operators included."""
    seconds = []
    for _ in range(REPEATS):
        began = time.process_time()
        error = errors(cells, tolerance)
        seconds.append(time.process_time() - began)
    return error, statistics.median(seconds)


def closed_forms(grids: list[int]) -> Iterator[Point]:
    """All cases with a closed form, and the coupled one, over grids and tolerances."""
    cases = CLOSED | {"coupled, against 192²": coupled_reference(192)}
    for name, errors in cases.items():
        errors(grids[0], TOLERANCES[0])  # compilation
        for cells in grids:
            for tolerance in TOLERANCES:
                yield Point(name, cells, tolerance, *timed(errors, cells, tolerance))
        print(f"{name}: done", flush=True)


def scenes(names: list[str]) -> Iterator[Point | Kept]:
    """Whole scenes against a fine run, then on request."""
    for name in names:
        plan = Scene.from_toml(name).plan()
        fine = run(plan, FINE)
        for cells in (12, 20, 40, 60):
            began = time.process_time()
            log = run(plan, Fidelity(cells))
            yield Point(name, cells, 1e-4, difference(log, fine).largest, time.process_time() - began)
        for asked in ASKED:
            began = time.process_time()
            found = simulate_to(plan, accuracy=asked)
            seconds = time.process_time() - began
            yield Kept(name, asked, found.error.largest, difference(found.log, fine).largest, seconds)
        print(f"{name}: done", flush=True)


def load_steps(names: list[str]) -> Iterator[Stepped]:
    """Scenes on the default grid in ever more load steps, against the finest."""
    for name in names:
        plan = (CREEPING if name == CREEPING.name else Scene.from_toml(name)).plan()
        fine = run(plan, Fidelity(substeps=FINEST_STEPS, tolerance=1e-5))
        for substeps in STEPS:
            began = time.process_time()
            log = run(plan, Fidelity(substeps=substeps))
            seconds, error = time.process_time() - began, difference(log, fine)
            assert log.truth is not None
            assert fine.truth is not None
            mean = float(np.nanmean(np.abs(log.truth.stick_ratio - fine.truth.stick_ratio)))
            steps = int(log.metadata["steps"])
            yield Stepped(name, substeps, steps, error.stick_ratio, mean, error.displacement, error.force, seconds)
        print(f"{name}: steps done", flush=True)


def step_curves(stepped: list[Stepped]) -> Figure:
    """Error of load steps against their number, with lines of first and second order."""
    figure = Figure(figsize=(11.0, 4.2), layout="constrained")
    panels = figure.subplots(1, 2)
    for axes, measure in zip(panels, ("displacement", "mean_stick_ratio"), strict=True):
        for name in dict.fromkeys(entry.scene for entry in stepped):
            own = [entry for entry in stepped if entry.scene == name]
            axes.loglog([e.steps for e in own], [getattr(e, measure) or np.nan for e in own], "o-", ms=4, label=name)
        first = [entry for entry in stepped if entry.scene == stepped[0].scene]
        for order, style in ((1, ":"), (2, "--")):
            falls = [getattr(first[0], measure) * (first[0].steps / entry.steps) ** order for entry in first]
            axes.loglog([entry.steps for entry in first], falls, style, color="0.5", label=f"order {order}")
        axes.set(title=measure.replace("_", " "), xlabel="load steps", ylabel="error")
        axes.xaxis.set_minor_formatter(NullFormatter())
        axes.grid(visible=True, which="both", alpha=0.3)
    panels[0].legend(fontsize=8)
    return figure


def step_table(stepped: list[Stepped]) -> str:
    """Errors of load steps and times."""
    lines = [
        "| scene | steps | stick ratio | its mean | displacement | force | seconds |",
        "|---|---|---|---|---|---|---|",
    ]
    lines += [
        f"| {e.scene} | {e.steps} | {e.stick_ratio:.4f} | {e.mean_stick_ratio:.5f} | {e.displacement:.1e} "
        f"| {e.force:.1e} | {e.seconds:.2f} |"
        for e in stepped
    ]
    return "\n".join(lines)


def order_table(stepped: list[Stepped]) -> str:
    """Orders in load steps between the first and the last row of each scene; none where nothing is left."""
    measures = ("displacement", "force", "mean_stick_ratio")
    lines = ["| scene | displacement | force | mean of the stick ratio |", "|---|---|---|---|"]
    for name in dict.fromkeys(entry.scene for entry in stepped):
        own = [entry for entry in stepped if entry.scene == name]
        growth, told = np.log(own[-1].steps / own[0].steps), []
        for measure in measures:
            first, last = getattr(own[0], measure), getattr(own[-1], measure)
            told.append(f"{np.log(first / last) / growth:.2f}" if last > 0.0 else "")
        lines.append(f"| {name} | " + " | ".join(told) + " |")
    return "\n".join(lines)


def curves(points: list[Point]) -> Figure:
    """Error against time, a panel for each case."""
    cases = list(dict.fromkeys(point.case for point in points))
    rows = -(-len(cases) // 3)
    figure = Figure(figsize=(13.0, 3.7 * rows), layout="constrained")
    panels = figure.subplots(rows, 3, squeeze=False).ravel()
    for axes, case in zip(panels, cases, strict=False):
        for tolerance in dict.fromkeys(p.tolerance for p in points if p.case == case):
            own = [p for p in points if (p.case, p.tolerance) == (case, tolerance)]
            axes.loglog([p.seconds for p in own], [p.error for p in own], "o-", ms=4, label=f"tolerance {tolerance:g}")
        for point in [p for p in points if (p.case, p.tolerance) == (case, own[0].tolerance)]:
            axes.annotate(str(point.cells), (point.seconds, point.error), textcoords="offset points", xytext=(4, 4))
        axes.set(title=case, xlabel="processor time, s", ylabel="error")
        axes.xaxis.set_minor_formatter(NullFormatter())  # labels of a part of a decade overlap
        axes.grid(visible=True, which="both", alpha=0.3)
        axes.legend(fontsize=8)
    for axes in panels[len(cases) :]:
        axes.set_visible(False)
    return figure


def table(points: list[Point]) -> str:
    """Errors and times at the tightest tolerance, with the observed order between grids."""
    lines = ["| case | cells | error | order | seconds |", "|---|---|---|---|---|"]
    for case in dict.fromkeys(point.case for point in points):
        own = [point for point in points if point.case == case]
        own = [point for point in own if point.tolerance == min(p.tolerance for p in own)]
        for before, point in zip([None, *own[:-1]], own, strict=True):
            order = (
                ""
                if before is None
                else f"{np.log(before.error / point.error) / np.log(point.cells / before.cells):.2f}"
            )
            lines.append(f"| {case} | {point.cells} | {point.error:.2e} | {order} | {point.seconds:.3f} |")
    return "\n".join(lines)


def request_table(kept: list[Kept]) -> str:
    """What was asked, estimated and true."""
    lines = ["| scene | asked | estimated | true | seconds |", "|---|---|---|---|---|"]
    lines += [f"| {k.scene} | {k.asked:g} | {k.estimated:.4f} | {k.true:.4f} | {k.seconds:.2f} |" for k in kept]
    return "\n".join(lines)


def main() -> None:
    """Measure, write, print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--output", type=Path, default=Path("benchmark-output"))
    parser.add_argument("--cells", type=int, nargs="+", default=[16, 32, 64, 128])
    parser.add_argument("--scenes", nargs="*", default=list(SCENES), help="the layered one takes minutes")
    parser.add_argument("--stepped", nargs="+", choices=STEPPED, default=list(STEPPED), help="scenes of load steps")
    parser.add_argument("--parts", nargs="+", choices=PARTS, default=list(PARTS), help="what to measure")
    options = parser.parse_args()
    options.output.mkdir(parents=True, exist_ok=True)
    if "cells" in options.parts:
        measured = [*closed_forms(options.cells), *scenes(options.scenes)]
        points = [entry for entry in measured if isinstance(entry, Point)]
        kept = [entry for entry in measured if isinstance(entry, Kept)]
        records = {"points": [asdict(point) for point in points], "on_request": [asdict(entry) for entry in kept]}
        (options.output / "contact_accuracy.json").write_text(json.dumps(records, indent=1))
        save(curves(points), options.output / "contact_accuracy.png")
        print(table(points), request_table(kept), sep="\n\n")
    if "steps" in options.parts:
        stepped = list(load_steps(options.stepped))
        (options.output / "contact_accuracy_steps.json").write_text(
            json.dumps([asdict(entry) for entry in stepped], indent=1)
        )
        save(step_curves(stepped), options.output / "contact_accuracy_steps.png")
        print(step_table(stepped), order_table(stepped), sep="\n\n")


if __name__ == "__main__":
    main()
