"""What accuracy costs in time: `python -m benchmarks.contact.accuracy [--output FOLDER] [--cells ...] [--scenes ...]`.

Error against processor time over grids and tolerances, for each contact problem with a closed form (`closed`); of
whole scenes over grids against a fine run, with what `simulate(scene, accuracy=...)` was asked and what it kept
(`scenes`); the error of load steps alone (`steps`), and of the times at which the stick ratio changes (`times`).
`--parts steps` measures only these. Writes JSON and pictures, prints Markdown tables.
"""

import argparse
import json
import statistics
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from functools import cache, partial
from itertools import product
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter

from benchmarks.pages import save
from slipcore.contact import reference
from slipcore.contact.effects import LoadPath, SensorSampling, Viscoelasticity
from slipcore.contact.elasticity.grid import Grid
from slipcore.contact.elasticity.influence import HalfSpace
from slipcore.contact.elasticity.operator import Operators
from slipcore.contact.plan.plan import Plan
from slipcore.contact.reference.mindlin_deresiewicz import MindlinDeresiewicz
from slipcore.contact.reference.torsion import TorsionPartialSlip, sliding_moment
from slipcore.contact.scene import Scene
from slipcore.contact.solver.normal import NormalContact, solve_normal
from slipcore.contact.solver.problem import ContactProblem, StepLoad
from slipcore.contact.solver.quasi_static import QuasiStatic
from slipcore.contact.solver.state import StepResult
from slipcore.contact.tiers.accuracy import difference, simulate_to
from slipcore.contact.tiers.boundary_elements import Fidelity, run
from slipcore.contact.tiers.edges import centre_field, centre_forces, shares_within_edge
from slipcore.contact.tiers.fronts import shares_within
from slipcore.frames import FloatArray, GraspLog

FRICTION, RADIUS, FORCE, YOUNG = 0.4, 15e-3, 10.0, 1e6
HERTZ = reference.HertzContact(RADIUS, FORCE, reference.half_space(YOUNG, 0.0))
SLIDING = FRICTION * FORCE
WIDTHS = (2.1, 2.13, 2.17, 2.2, 2.26)
"""Of grids, in contact radii: on each, cells lie otherwise on the contact's edge, and single ones scatter by that."""
TOLERANCES = (1e-2, 1e-4, 1e-7)
LOOP = (0.5, 0.9, 0.4, 0.0, -0.5, -0.9, -0.3, 0.5, 0.9)
"""Loads, as shares of μF_N, that turn back twice."""
POISSON = 0.45
"""Of the body in cases without a closed form."""
SCENES = (
    "table1_condition1",
    "table1_condition2",
    "table1_condition3",
    "table1_condition4",
    "table1_condition1_layer",
)
ASKED = (0.1, 0.05, 0.02)
CELLS = (12, 17, 24, 34, 48, 68, 96)
"""Across the contact of a scene, a factor of √2 apart, on grids of any pitch: on those that are aligned with the sensor
two of these may be one.
"""
FINE = Fidelity(cells=180, substeps=2, tolerance=1e-6, aligned=False)
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
LEVELS = (0.9, 0.5, 0.1)
"""Of a scene's range of stick ratio: where times are taken at which it passes."""
PARTS = ("closed", "scenes", "steps", "times")

Errors = Callable[[Grid, float], float]


@dataclass(frozen=True, slots=True)
class Point:
    """One run: cells across the grid, tolerance, error, median processor seconds."""

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
class SceneRun:
    """A scene against a finer run of it: ``cells`` across the contact, ``substeps`` a frame, ``steps`` in all, the
    largest absolute error of the stick ratio and its mean over time, relative L2 of displacement and force, processor
    seconds.
    """

    scene: str
    cells: int
    substeps: int
    steps: int
    stick_ratio: float
    mean_stick_ratio: float
    displacement: float
    force: float
    seconds: float


@dataclass(frozen=True, slots=True)
class Passed:
    """When the stick ratio of a scene passes ``LEVELS``, against far more load steps: ``steps`` in all, ``times`` it
    passes one, the largest and the median error s of these, NaN if one passes more often; seconds a frame lasts.
    """

    scene: str
    steps: int
    times: int
    largest: float
    median: float
    frame: float


MEASURES = ("displacement", "force", "mean_stick_ratio")


def relative(values: FloatArray, exact: FloatArray) -> float:
    """Relative L2 difference."""
    return float(np.sqrt(((values - exact) ** 2).sum() / (exact**2).sum()))


def hertz_grid(cells: int, width: float) -> Grid:
    """Grid around the contact, ``width`` contact radii wide."""
    return Grid.square(cells, width * HERTZ.contact_radius)


def sphere(poisson: float, *, coupled: bool = False) -> ContactProblem:
    """The paper's fingertip on a flat object."""
    heights = (lambda x, y: (x**2 + y**2) / (2.0 * RADIUS),)
    return ContactProblem((HalfSpace.from_young(YOUNG, poisson),), FRICTION, heights=heights, coupled=coupled)


def shear(along_x: float, moment: float = 0.0) -> StepLoad:
    """Full normal force and a tangential load."""
    return StepLoad(FORCE, tangential=np.array([along_x, 0.0, moment]))


def stepped(problem: ContactProblem, grid: Grid, tolerance: float, loads: list[StepLoad]) -> list[StepResult]:
    """Results of loads on a grid."""
    return list(QuasiStatic(problem, grid, tolerance, 1e-2 * tolerance).run(loads))


# Cases with a closed form, or a finer run: error of one run


def hertz(grid: Grid, tolerance: float, *, corrected: bool = False) -> float:
    """Pressure of a sphere."""
    pressure = _hertz(grid, tolerance).pressure
    found = centre_field(pressure, pressure > 0.0) if corrected else pressure
    return relative(found, HERTZ.pressure(np.hypot(*grid.points())))


def _hertz(grid: Grid, tolerance: float) -> NormalContact:
    x, y = grid.points()
    height = (x**2 + y**2) / (2.0 * RADIUS)
    operators = Operators((HalfSpace.from_young(YOUNG, 0.0),))
    return solve_normal(operators, grid, height, force=FORCE, tolerance=tolerance)


def contact_area(grid: Grid, tolerance: float, *, corrected: bool = False) -> float:
    """Area within the front of a sphere's pressure."""
    pressure = _hertz(grid, tolerance).pressure
    touches = pressure > 0.0
    shares = shares_within_edge(pressure, touches) if corrected else shares_within(pressure**2, touches)
    return float(abs(shares.sum() * grid.cell_area / (np.pi * HERTZ.contact_radius**2) - 1.0))


def stresses(results: list[StepResult], grid: Grid, *, corrected: bool, poisson: float = 0.0) -> list[FloatArray]:
    """Stress of each step [3, ny, nx] Pa, of the cells or, by what is known of edges, at their centres."""
    forces = centre_forces(results, poisson) if corrected else (result.force for result in results)
    return [force / grid.cell_area for force in forces]


def cattaneo_mindlin(grid: Grid, tolerance: float, *, corrected: bool = False) -> float:
    """Traction at F_T = 0.7 μF_N, ν = 0."""
    results = stepped(sphere(0.0), grid, tolerance, [shear(0.0), shear(0.7 * SLIDING)])
    exact = reference.CattaneoMindlin(HERTZ, FRICTION, 0.7 * SLIDING).traction(np.hypot(*grid.points()))
    return relative(stresses(results, grid, corrected=corrected)[-1][0], exact)


def reversal(grid: Grid, tolerance: float, *, corrected: bool = False) -> float:
    """Traction on a loop between ±0.9 μF_N, ν = 0; the largest error, of the traction at the peak."""
    forces = SLIDING * np.array([0.0, *LOOP])
    r = np.hypot(*grid.points())
    exact, errors = MindlinDeresiewicz(HERTZ, FRICTION), []
    peak = np.sqrt((exact.load(FORCE, 0.9 * SLIDING).traction(r) ** 2).sum())
    results = stepped(sphere(0.0), grid, tolerance, [shear(f) for f in forces])
    for force, stress in zip(forces, stresses(results, grid, corrected=corrected), strict=True):
        exact = exact.load(FORCE, float(force))
        errors.append(np.sqrt(((stress[0] - exact.traction(r)) ** 2).sum()) / peak)
    return float(max(errors))


def torsion(grid: Grid, tolerance: float, *, corrected: bool = False, poisson: float = 0.0) -> float:
    """Traction at 0.6 of the sliding moment."""
    hertz = replace(HERTZ, compliance=reference.half_space(YOUNG, poisson))
    moment = 0.6 * sliding_moment(hertz, FRICTION)
    results = stepped(sphere(poisson), grid, tolerance, [shear(0.0), shear(0.0, moment)])
    stress = stresses(results, grid, corrected=corrected, poisson=poisson)[-1]
    x, y = grid.points()
    r = np.hypot(x, y)
    around = np.where(r > 0.0, np.stack((-y, x)) / np.where(r > 0.0, r, 1.0), 0.0)
    return relative(stress[:2], TorsionPartialSlip(hertz, FRICTION, moment).traction(r) * around)


def without_closed_form(grid: Grid, tolerance: float, *, corrected: bool = False, shares: tuple[float, ...]) -> float:
    """Traction under loads along x, as shares of μF_N, at ν = 0.45; the largest error, of the traction at the peak."""
    results = stepped(sphere(POISSON), grid, tolerance, [shear(0.0), *(shear(share * SLIDING) for share in shares)])
    found = [stress[:2] for stress in stresses(results, grid, corrected=corrected, poisson=POISSON)]
    exact = on_finer_cells(grid, shares)
    errors = [np.linalg.norm(stress - right) for stress, right in zip(found, exact, strict=True)]
    return float(max(errors) / max(np.linalg.norm(right) for right in exact))


@cache
def on_finer_cells(grid: Grid, shares: tuple[float, ...], poisson: float = POISSON) -> list[FloatArray]:
    """The same tractions [2, ny, nx] Pa from a grid that lies at another angle, with edges corrected.

    In fifths of a cell a turn by 0.8 and 0.6 is one by whole numbers: centres of cells are centres of finer ones, too.
    """
    turn, pitch = np.array([[0.8, 0.6], [-0.6, 0.8]]), grid.pitch[0] / 5.0
    places = np.tensordot(turn, np.stack(grid.points()), 1) / pitch
    centre = places[:, 0, 0] - np.rint(places[:, 0, 0])
    half = int(1.03 * HERTZ.contact_radius / pitch)
    finer = Grid((2 * half + 1, 2 * half + 1), (pitch, pitch), (float(centre[0] * pitch), float(centre[1] * pitch)))
    along = SLIDING * np.append(turn[:, 0], 0.0)
    loads = [StepLoad(FORCE, tangential=share * along) for share in (0.0, *shares)]
    columns, rows = np.rint(places - centre[:, None, None]).astype(int) + half
    known, found = np.maximum(np.abs(columns - half), np.abs(rows - half)) <= half, []
    for stress in stresses(stepped(sphere(poisson), finer, 1e-7, loads), finer, corrected=True, poisson=poisson):
        here = np.zeros((2, *grid.shape))
        here[:, known] = stress[:2, rows[known], columns[known]]
        found.append(np.tensordot(turn.T, here, 1))
    return found


CORRECTED = ", corrected"
"""Of a case in which what is known of edges is used."""
_CASES: dict[str, Callable[..., float]] = {
    "Hertz": hertz,
    "Hertz, contact area": contact_area,
    "Cattaneo–Mindlin": cattaneo_mindlin,
    "unloading and reversal": reversal,
    "torsion": torsion,
    "torsion, ν = 0.45": partial(torsion, poisson=POISSON),
    "one load, ν = 0.45": partial(without_closed_form, shares=(0.7,)),
    "reversal, ν = 0.45": partial(without_closed_form, shares=LOOP),
}
CLOSED: dict[str, Errors] = {
    name + CORRECTED * corrected: partial(errors, corrected=corrected)
    for name, errors in _CASES.items()
    for corrected in (False, True)
}


def coupled_reference(cells: int) -> Errors:
    """Forces of a coupled contact at ν = 0.2 against a run on a grid of ``cells``, both summed over 16² elements."""

    def forces(grid: Grid, tolerance: float) -> FloatArray:
        loads = [shear(0.0), *(shear(share * SLIDING) for share in (0.25, 0.5, 0.75))]
        last, part = stepped(sphere(0.2, coupled=True), grid, tolerance, loads)[-1].force, grid.shape[0] // 16
        return last.reshape(3, 16, part, 16, part).sum(axis=(2, 4))

    @cache
    def fine(width: float) -> FloatArray:
        return forces(Grid.square(cells, width), 1e-7)

    return lambda grid, tolerance: relative(forces(grid, tolerance), fine(grid.shape[0] * grid.pitch[0]))


def timed(errors: Errors, cells: int, tolerance: float) -> tuple[float, float]:
    """Root mean square of the errors on grids of all widths, and median processor seconds of one, set-up of operators
    included.
    """
    found, seconds = [], []
    for width in WIDTHS:
        grid, began = hertz_grid(cells, width), time.process_time()
        found.append(errors(grid, tolerance))
        seconds.append(time.process_time() - began)
    return float(np.sqrt(np.mean(np.square(found)))), statistics.median(seconds)


def closed_forms(cells: list[int]) -> Iterator[Point]:
    """All cases with a closed form, and the coupled one, over grids and tolerances."""
    cases = CLOSED | {"coupled, against 192²": coupled_reference(192)}
    for name, errors in cases.items():
        for count, width in product(cells, WIDTHS):  # compilation, and finer runs to compare with
            errors(hertz_grid(count, width), TOLERANCES[0])
        for count in cells:
            for tolerance in TOLERANCES:
                yield Point(name, count, tolerance, *timed(errors, count, tolerance))
        print(f"{name}: done", flush=True)


def scenes(names: list[str]) -> Iterator[SceneRun | Kept]:
    """Whole scenes over grids against a fine run, then on request."""
    for name in names:
        plan = plan_of(name)
        fine = run(plan, FINE)
        for cells in CELLS:
            yield scene_run(name, plan, Fidelity(cells, aligned=False), fine)
        for asked in ASKED:
            began = time.process_time()
            found = simulate_to(plan, accuracy=asked)
            seconds = time.process_time() - began
            yield Kept(name, asked, found.error.largest, difference(found.log, fine).largest, seconds)
        print(f"{name}: done", flush=True)


def load_steps(names: list[str]) -> Iterator[SceneRun]:
    """Scenes on the default grid in ever more load steps, against the finest."""
    for name in names:
        plan = plan_of(name)
        fine = run(plan, Fidelity(substeps=FINEST_STEPS, tolerance=1e-5))
        for substeps in STEPS:
            yield scene_run(name, plan, Fidelity(substeps=substeps), fine)
        print(f"{name}: steps done", flush=True)


def plan_of(name: str, frames: int = 1) -> Plan:
    """That of a scene of the library, or of the one that creeps, with ``frames`` in place of each."""
    plan = (CREEPING if name == CREEPING.name else Scene.from_toml(name)).plan()
    if plan.sampling is None or frames == 1:
        return plan
    return replace(plan, sampling=replace(plan.sampling, frame_rate=frames * plan.sampling.frame_rate))


def passing_times(names: list[str]) -> Iterator[Passed]:
    """Scenes on the default grid with a frame for each load step, of which there are ever more."""
    for name in names:
        fine = run(plan_of(name, FINEST_STEPS), Fidelity(tolerance=1e-5))
        levels, frame = _levels(fine), float(np.diff(fine.time).min()) * FINEST_STEPS
        exact = passes(fine, levels)
        for count in STEPS:
            log = run(plan_of(name, count), Fidelity())
            found = passes(log, levels)
            errors = np.abs(found - exact) if len(found) == len(exact) else np.array([np.nan])
            shown = float(errors.max()), float(np.median(errors))
            yield Passed(name, int(log.metadata["steps"]), len(found), *shown, frame)
        print(f"{name}: times done", flush=True)


def _levels(log: GraspLog) -> list[float]:
    assert log.truth is not None
    low, high = np.nanmin(log.truth.stick_ratio), np.nanmax(log.truth.stick_ratio)
    return [float(low + share * (high - low)) for share in LEVELS]


def passes(log: GraspLog, levels: list[float]) -> FloatArray:
    """Times s at which a log's stick ratio passes each level, on lines between frames."""
    assert log.truth is not None
    touches = np.isfinite(log.truth.stick_ratio)
    time, ratio, found = log.time[touches], log.truth.stick_ratio[touches], list[FloatArray]()
    for level in levels:
        above = ratio - level
        at = np.flatnonzero((above[1:] < 0.0) != (above[:-1] < 0.0))
        found.append(time[at] + (time[at + 1] - time[at]) * above[at] / (above[at] - above[at + 1]))
    return np.concatenate(found)


def scene_run(name: str, plan: Plan, fidelity: Fidelity, fine: GraspLog) -> SceneRun:
    """Run a scene, and hold it against a finer run."""
    began = time.process_time()
    log = run(plan, fidelity)
    seconds, error = time.process_time() - began, difference(log, fine)
    assert log.truth is not None
    assert fine.truth is not None
    mean = float(np.nanmean(np.abs(log.truth.stick_ratio - fine.truth.stick_ratio)))
    errors = (error.stick_ratio, mean, error.displacement, error.force)
    return SceneRun(name, fidelity.cells, fidelity.substeps, int(log.metadata["steps"]), *errors, seconds)


def step_curves(stepped: list[SceneRun]) -> Figure:
    """Error of load steps against their number, with lines of first and second order."""
    figure = Figure(figsize=(11.0, 4.2), layout="constrained")
    panels = figure.subplots(1, 2)
    first = [entry for entry in stepped if entry.scene == stepped[0].scene]
    for axes, measure in zip(panels, ("displacement", "mean_stick_ratio"), strict=True):
        _draw(axes, stepped, measure, "steps")
        for order, style in ((1, ":"), (2, "--")):
            falls = [getattr(first[0], measure) * (first[0].steps / entry.steps) ** order for entry in first]
            axes.loglog([entry.steps for entry in first], falls, style, color="0.5", label=f"order {order}")
        axes.set(xlabel="load steps")
    panels[0].legend(fontsize=8)
    return figure


def scene_curves(found: list[SceneRun]) -> Figure:
    """Errors of scenes against time, by what is measured; the numbers are cells across the contact."""
    figure = Figure(figsize=(13.0, 4.2), layout="constrained")
    panels = figure.subplots(1, 3)
    for axes, measure in zip(panels, MEASURES, strict=True):
        _draw(axes, found, measure, "seconds")
        for entry in found:
            if entry.scene in (found[0].scene, found[-1].scene):
                at = (entry.seconds, getattr(entry, measure))
                axes.annotate(str(entry.cells), at, textcoords="offset points", xytext=(4, 4), fontsize=7)
        axes.set(xlabel="processor time, s")
    panels[0].legend(fontsize=8)
    return figure


def _draw(axes: Axes, found: list[SceneRun], measure: str, against: str) -> None:
    for name in dict.fromkeys(entry.scene for entry in found):
        own = [entry for entry in found if entry.scene == name]
        places, errors = [getattr(e, against) for e in own], [getattr(e, measure) or np.nan for e in own]
        axes.loglog(places, errors, "o-", ms=4, label=name)
    axes.set(title=measure.replace("_", " "), ylabel="error")
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.grid(visible=True, which="both", alpha=0.3)


def run_table(found: list[SceneRun], over: str) -> str:
    """Errors and times of scenes ``over`` cells or steps."""
    lines = [
        f"| scene | {over} | stick ratio | its mean | displacement | force | seconds |",
        "|---|---|---|---|---|---|---|",
    ]
    lines += [
        f"| {e.scene} | {getattr(e, over)} | {e.stick_ratio:.4f} | {e.mean_stick_ratio:.5f} | {e.displacement:.1e} "
        f"| {e.force:.1e} | {e.seconds:.2f} |"
        for e in found
    ]
    return "\n".join(lines)


def order_table(found: list[SceneRun], over: str) -> str:
    """Orders in cells or steps between the first and the last row of each scene; none where nothing is left."""
    lines = ["| scene | displacement | force | mean of the stick ratio |", "|---|---|---|---|"]
    for name in dict.fromkeys(entry.scene for entry in found):
        own = [entry for entry in found if entry.scene == name]
        growth, told = np.log(getattr(own[-1], over) / getattr(own[0], over)), []
        for measure in MEASURES:
            first, last = getattr(own[0], measure), getattr(own[-1], measure)
            told.append(f"{np.log(first / last) / growth:.2f}" if last > 0.0 else "")
        lines.append(f"| {name} | " + " | ".join(told) + " |")
    return "\n".join(lines)


def curves(points: list[Point]) -> Figure:
    """Error against time, a panel for each case, in which a dashed line is the case with edges corrected."""
    cases = list(dict.fromkeys(point.case.removesuffix(CORRECTED) for point in points))
    rows = -(-len(cases) // 3)
    figure = Figure(figsize=(13.0, 3.7 * rows), layout="constrained")
    panels = figure.subplots(rows, 3, squeeze=False).ravel()
    for axes, case in zip(panels, cases, strict=False):
        for color, tolerance in enumerate(dict.fromkeys(p.tolerance for p in points)):
            for name, style in ((case, "o-"), (case + CORRECTED, "s--")):
                own = [p for p in points if (p.case, p.tolerance) == (name, tolerance)]
                label = f"tolerance {tolerance:g}" if name == case else None
                axes.loglog(
                    [p.seconds for p in own], [p.error for p in own], style, ms=4, label=label, color=f"C{color}"
                )
        for point in [p for p in points if (p.case, p.tolerance) == (case, min(p.tolerance for p in points))]:
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


def passing_table(found: list[Passed]) -> str:
    """Errors of the times at which the stick ratio passes its levels, in seconds and in frames."""
    lines = ["| scene | steps | passes | largest error, s | in frames | median, s |", "|---|---|---|---|---|---|"]
    for e in found:
        largest = (
            f"{e.largest:.1e} | {e.largest / e.frame:.2f} | {e.median:.1e}" if np.isfinite(e.largest) else " |  | "
        )
        lines.append(f"| {e.scene} | {e.steps} | {e.times} | {largest} |")
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
    parser.add_argument("--scenes", nargs="*", default=list(SCENES), help="of the library")
    parser.add_argument("--stepped", nargs="+", choices=STEPPED, default=list(STEPPED), help="scenes of load steps")
    parser.add_argument("--parts", nargs="+", choices=PARTS, default=list(PARTS), help="what to measure")
    options = parser.parse_args()
    options.output.mkdir(parents=True, exist_ok=True)
    output = options.output
    if "closed" in options.parts:
        points = list(closed_forms(options.cells))
        save(curves(points), output / "contact_accuracy.png")
        report(output / "contact_accuracy.json", points, table(points))
    if "scenes" in options.parts:
        measured = list(scenes(options.scenes))
        found = [entry for entry in measured if isinstance(entry, SceneRun)]
        kept = [entry for entry in measured if isinstance(entry, Kept)]
        save(scene_curves(found), output / "contact_accuracy_scenes.png")
        report(output / "contact_accuracy_scenes.json", found, run_table(found, "cells"), order_table(found, "cells"))
        report(output / "contact_accuracy_requests.json", kept, request_table(kept))
    if "steps" in options.parts:
        stepped = list(load_steps(options.stepped))
        save(step_curves(stepped), output / "contact_accuracy_steps.png")
        report(
            output / "contact_accuracy_steps.json", stepped, run_table(stepped, "steps"), order_table(stepped, "steps")
        )
    if "times" in options.parts:
        passed = list(passing_times(options.stepped))
        report(output / "contact_accuracy_times.json", passed, passing_table(passed))


def report(path: Path, entries: Sequence[Point | SceneRun | Kept | Passed], *tables: str) -> None:
    """Write what was measured as JSON, and print its tables."""
    path.write_text(json.dumps([asdict(entry) for entry in entries], indent=1))
    print(*tables, sep="\n\n", end="\n\n")


if __name__ == "__main__":
    main()
