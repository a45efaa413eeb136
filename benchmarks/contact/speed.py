"""What a contact step costs: `python -m benchmarks.contact.speed [--output FOLDER]`.

Medians of processor time (one thread, so that other programs matter little) over warm-started load steps of the
paper's Condition 1 (sphere of 15 mm, F_N = 10 N, F_T to 3.96 N in 50 steps), at residuals of 1e-4 and 1e-8 of the
largest limit; beside each its floor, the number of convolutions times the cost of one, those in double and in single
precision each by its own, all measured; what the preconditioner takes likewise, and Newton's rounds. Then normal
contact from nothing, coupled steps, the steps of few cells that audits of control take, whole scenes, and the memory of
1024 × 1024 cells. Writes contact_speed.json and prints a Markdown table. `--parts` measures only some of that.
"""

import argparse
import json
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np

from slipcore.contact import simulate
from slipcore.contact.defaults import FIDELITY
from slipcore.contact.elasticity.grid import Grid
from slipcore.contact.elasticity.influence import HalfSpace
from slipcore.contact.elasticity.operator import Count, ElasticOperator, Operators
from slipcore.contact.elasticity.transform import convolve
from slipcore.contact.scene import Scene
from slipcore.contact.solver.normal import solve_normal
from slipcore.contact.solver.problem import ContactProblem, StepLoad
from slipcore.contact.solver.quasi_static import QuasiStatic
from slipcore.contact.solver.state import StepResult
from slipcore.contact.tiers.boundary_elements import Fidelity

YOUNG, RADIUS, FORCE, FRICTION = 1e6, 15e-3, 10.0, 0.4
STEPS, LARGEST = 50, 3.96
SCENES = (
    "table1_condition1",
    "table1_condition2",
    "table1_condition3",
    "table1_condition4",
    "table1_condition1_layer",
)
MIB = 1024.0


@dataclass(frozen=True, slots=True)
class Cost:
    """Median ``milliseconds`` (of ``count`` measurements), the ``target``, the ``floor`` that convolutions alone
    take, their number (``convolutions``, of one component each), the largest ``residual``, Newton's mean ``rounds``
    a step, and milliseconds of the ``preconditioner``.
    """

    what: str
    milliseconds: float
    target: float | None
    floor: float | None
    convolutions: float | None
    residual: float | None
    count: int
    rounds: float | None = None
    preconditioner: float | None = None


def bowl(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Gap of the sphere."""
    return (x**2 + y**2) / (2.0 * RADIUS)


def width(poisson: float) -> float:
    """Side of a grid that the contact just fills, m."""
    return 2.1 * float(np.cbrt(0.75 * FORCE * RADIUS * (1.0 - poisson**2) / YOUNG))


def shear_steps(cells: int, residual: float, poisson: float, coupled: bool) -> list[StepResult]:
    """Results of the steps of tangential force, which are to be solved to a residual."""
    body = HalfSpace.from_young(YOUNG, poisson)
    problem = ContactProblem((body,), FRICTION, heights=(bowl,), coupled=coupled)
    share = LARGEST / STEPS / (FRICTION * FORCE)  # tolerances are relative to what a step changes
    solver = QuasiStatic(problem, Grid.square(cells, width(poisson)), residual / share, 1e-7)
    state, _ = solver.step(solver.start(), StepLoad(FORCE))
    results = []
    for force in np.linspace(0.0, LARGEST, STEPS + 1)[1:]:
        began = time.process_time()
        state, result = solver.step(state, StepLoad(FORCE, tangential=np.array([force, 0.0, 0.0])))
        results.append(replace(result, seconds=time.process_time() - began))
    return results


def median_time(call: Callable[[], object], repeats: int = 9) -> float:
    """Median milliseconds of a call, after one that is not counted."""
    call()
    seconds = []
    for _ in range(repeats):
        begin = time.process_time()
        call()
        seconds.append(time.process_time() - begin)
    return 1e3 * float(np.median(seconds))


def convolution(cells: int, poisson: float) -> tuple[float, float, float]:
    """Milliseconds of one tangential application, two components to two, of one in single precision, and of its
    preconditioner.
    """
    grid = Grid.square(cells, width(poisson))
    operator = ElasticOperator((HalfSpace.from_young(YOUNG, poisson),), grid)
    traction = np.random.default_rng(0).standard_normal((2, *grid.shape))
    field, result = traction.astype(np.float32), np.empty(traction.shape, dtype=np.float32)
    single, inverse = operator.tangential_single, operator.tangential_inverse.single
    return (
        median_time(lambda: operator.tangential(traction), 25),
        median_time(lambda: convolve(field, result, single), 25),
        median_time(lambda: convolve(field, result, inverse), 25),
    )


def applications(count: Count) -> float:
    """Applications in units of a tangential one, which has two components."""
    return count.tangential + 0.5 * count.normal + 0.75 * count.coupling


def step_cost(what: str, cells: int, residual: float, target: float | None, poisson: float, coupled: bool) -> Cost:
    """Median cost of a warm-started step."""
    results = [r for _ in range(3) for r in shear_steps(cells, residual, poisson, coupled)]
    needed = float(np.median([applications(r.applications) for r in results]))
    one, single, inverse = convolution(cells, poisson)
    floors = [
        one * (applications(r.applications) - r.applications.single) + single * r.applications.single for r in results
    ]
    rounds = float(np.mean([r.iterations for r in results]))
    inverted = float(np.mean([r.applications.inverse for r in results]))
    return Cost(
        what,
        1e3 * float(np.median([r.seconds for r in results])),
        target,
        float(np.median(floors)),
        needed,
        max(r.residual for r in results),
        len(results),
        rounds,
        None if coupled else inverted * inverse,
    )


def steps() -> Iterator[Cost]:
    """Load steps on 64² and 128² cells, uncoupled and coupled."""
    for cells, targets in ((64, (5.0, 12.0)), (128, (20.0, 50.0))):
        for residual, target in zip((1e-4, 1e-8), targets, strict=True):
            yield step_cost(f"step, {cells}², residual {residual:.0e}", cells, residual, target, 0.3, coupled=False)
    yield step_cost("coupled step, 64², residual 1e-04", 64, 1e-4, None, 0.3, coupled=True)
    yield step_cost("coupled step, 64², ν = 0.49, residual 1e-04", 64, 1e-4, None, 0.49, coupled=True)


def small_steps() -> Iterator[Cost]:
    """Load steps on as few cells as the audit of grip control takes."""
    for cells in (12, 16, 20, 24):
        yield step_cost(f"step, {cells}², residual 1e-03", cells, 1e-3, 2.0, 0.3, coupled=False)
        yield step_cost(f"coupled step, {cells}², residual 1e-03", cells, 1e-3, 2.0, 0.3, coupled=True)


def presses() -> Iterator[Cost]:
    """Normal contact from nothing, to 1e-6 of the indentation."""
    for cells in (64, 128, 256, 512):
        grid = Grid.square(cells, width(0.0))
        operators, height = Operators((HalfSpace.from_young(YOUNG, 0.0),)), bowl(*grid.points())

        def press(operators: Operators = operators, grid: Grid = grid, height: np.ndarray = height) -> float:
            return solve_normal(operators, grid, height, force=FORCE, tolerance=1e-6).residual

        milliseconds = median_time(press, 7)
        yield Cost(f"normal contact from nothing, {cells}²", milliseconds, None, None, None, press(), 7)


def scenes() -> Iterator[Cost]:
    """Scenes of the library on their default grid and on 64 cells across the contact."""
    for cells, target in ((FIDELITY.cells, 300.0), (64, 1000.0)):
        for name in SCENES:
            yield scene_cost(name, Fidelity(cells=cells), 1000.0 if name.endswith("layer") else target)


def scene_cost(name: str, fidelity: Fidelity, target: float) -> Cost:
    """Median cost of a whole scene."""
    scene = Scene.from_toml(name)
    log = simulate(scene, fidelity=fidelity)
    what = f"scene {name}: {log.metadata['steps']} steps, {log.metadata['grid'].split(' of')[0]}"
    return Cost(what, median_time(lambda: simulate(scene, fidelity=fidelity), 3), target, None, None, None, 3)


PARTS: dict[str, Callable[[], Iterator[Cost]]] = {
    "steps": steps,
    "small": small_steps,
    "presses": presses,
    "scenes": scenes,
}

MEMORY = """
import resource
from benchmarks.contact.speed import press_once, shear_once
before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
{action}({cells})
print(before, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
"""


def press_once(cells: int) -> None:
    """Normal contact from nothing, for the memory that it takes."""
    grid = Grid.square(cells, width(0.0))
    solve_normal(Operators((HalfSpace.from_young(YOUNG, 0.0),)), grid, bowl(*grid.points()), force=FORCE)


def shear_once(cells: int) -> None:
    """A press, then two steps of partial slip, for the memory that they take."""
    problem = ContactProblem((HalfSpace.from_young(YOUNG, 0.3),), FRICTION, heights=(bowl,))
    pulls = [StepLoad(FORCE, tangential=np.array([force, 0.0, 0.0])) for force in (0.0, 1.2, 2.8)]
    for _ in QuasiStatic(problem, Grid.square(cells, width(0.3)), 1e-3, 1e-4, second_order=True).run(pulls):
        pass


def memory(action: str, cells: int) -> tuple[float, float]:
    """Largest resident size in MiB of a process that does one of the above, before and after."""
    script = MEMORY.format(action=action, cells=cells)
    found = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    before, after = (float(part) / MIB for part in found.stdout.split())
    return before, after


def table(costs: list[Cost]) -> str:
    """Markdown."""

    def text(value: float | None, form: str) -> str:
        return "" if value is None else format(value, form)

    columns = ("what", "median, ms", "target", "floor", "preconditioner", "rounds", "applications", "residual")
    lines = [f"| {' | '.join(columns)} |", "|---" * len(columns) + "|"]
    for c in costs:
        times = (f"{c.milliseconds:.1f}", text(c.target, ".0f"), text(c.floor, ".1f"), text(c.preconditioner, ".1f"))
        counts = (text(c.rounds, ".1f"), text(c.convolutions, ".0f"), text(c.residual, ".0e"))
        lines.append(f"| {' | '.join((c.what, *times, *counts))} |")
    return "\n".join(lines)


def main() -> None:
    """Measure, print, write JSON."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--output", type=Path, default=Path("benchmarks/results"))
    parser.add_argument("--parts", nargs="+", choices=(*PARTS, "memory"), default=[*PARTS, "memory"])
    options = parser.parse_args()
    options.output.mkdir(parents=True, exist_ok=True)
    costs = [cost for part in PARTS if part in options.parts for cost in PARTS[part]()]
    print(table(costs))
    uncoupled = [c.milliseconds for c in costs if c.what == "step, 64², residual 1e-04"]
    coupled = [c.milliseconds for c in costs if c.what.startswith("coupled step, 64²")]
    if uncoupled:
        print("\ncoupled over uncoupled:", ", ".join(f"{c / uncoupled[0]:.1f}" for c in coupled))
    sizes = {}
    if "memory" in options.parts:
        cases = [("press_once", cells) for cells in (256, 512, 1024)] + [("shear_once", 1024)]
        sizes = {(action, cells): memory(action, cells) for action, cells in cases}
    for (action, cells), (before, after) in sizes.items():
        what = "normal contact" if action == "press_once" else "partial slip"
        print(f"memory of {what}, {cells}²: {after - before:.0f} MiB over the {before:.0f} of the libraries")
    peaks = {f"{action} {cells}": after for (action, cells), (_, after) in sizes.items()}
    result = {"costs": [asdict(c) for c in costs], "memory_mib": peaks}
    (options.output / "contact_speed.json").write_text(json.dumps(result, indent=1), encoding="utf-8")


if __name__ == "__main__":
    main()
