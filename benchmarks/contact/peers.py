"""Other contact solvers beside this one: `python -m benchmarks.contact.peers [--peers-python PATH]`.

Tamaas, ContactMechanics and ASPHER on a sphere pressed on a half-space (64² to 512² cells) and ASPHER on partial slip
(128², 256²; ν = 0, F_T = 0.7 μF_N). All on the same grid 2.2 contact radii wide, one thread each, taken in turns; every
solver's tolerance is swept and the errors are measured against one reference, so that they compare at equal achieved
error. Peers run in the interpreter given by ``--peers-python``; one that is not there is named and left out. Writes
contact_peers.json and contact_peers.png.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, Self

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import NullFormatter

from slipcore.contact.elasticity.grid import Grid, bounding_box
from slipcore.contact.elasticity.influence import HalfSpace
from slipcore.contact.elasticity.operator import Operators
from slipcore.contact.reference.cattaneo_mindlin import CattaneoMindlin
from slipcore.contact.reference.elastic_pair import half_space
from slipcore.contact.reference.hertz import HertzContact
from slipcore.contact.solver.normal import solve_normal
from slipcore.contact.solver.tangential import SolverControl, solve_tangential
from slipcore.frames import FloatArray

OURS = "Stiction"
ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
"""For the peers; this project's solvers start no threads."""
PEERS = ("Tamaas", "ContactMechanics", "ASPHER", "ASPHER nested", "ASPHER friction")
YOUNG, RADIUS, FORCE, FRICTION, SHARE = 1e6, 15e-3, 10.0, 0.4, 0.7
HERTZ = HertzContact(RADIUS, FORCE, half_space(YOUNG, 0.0))
WIDTH = 2.2 * HERTZ.contact_radius
TOLERANCES = {
    "normal contact": (1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8),
    "partial slip": (1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7),
}
TARGETS = (1e-3, 1e-4, 1e-6)
ROUNDS = 3
TIME_LIMIT = 20.0
"""Seconds of one solution, after which a solver is asked for nothing tighter on that grid."""
FEATURES = (
    ("normal contact, free space", "yes", "yes", "yes", "yes"),
    ("periodic surfaces", "no", "yes", "yes", "yes"),
    ("force or displacement control", "both", "both", "both", "both (friction), force (normal)"),
    ("partial slip with history", "yes", "one step", "no", "yes"),
    ("torsion, moment control", "yes", "no", "no", "no"),
    ("Coulomb limit that varies in space", "yes", "no", "no", "through a user's law"),
    ("friction that depends on velocity", "yes", "no", "no", "yes"),
    ("normal–tangential coupling", "yes", "in the operator", "no", "no"),
    ("bonded layer", "yes", "no", "no", "no"),
    ("viscoelasticity", "yes", "yes (normal)", "no", "no"),
    ("adhesion", "no", "yes", "in a package of its own", "no"),
    ("plasticity", "no", "yes", "hardness", "no"),
    ("memory O(n), no FFT grid", "no", "no", "no", "yes (H²)"),
    ("several processes (MPI)", "no", "yes", "yes", "no"),
)
"""What each has, from the documentation and names of the versions measured, not from trials; columns: this, Tamaas,
ContactMechanics, ASPHER.
"""


@dataclass(frozen=True, slots=True)
class Run:
    """One solver at one tolerance: median ``seconds`` of the solution, ``setup`` before it, and relative L2 errors
    against the ``exact`` closed form and against the ``algebraic`` reference of the same grid.
    """

    problem: str
    solver: str
    cells: int
    tolerance: float
    setup: float
    seconds: float
    iterations: int
    algebraic: float
    exact: float


Answer = dict[str, Any]
Solver = Callable[[str, int, float], tuple[Answer, FloatArray | None]]


class Worker:
    """The peers' interpreter, kept running so that nothing but solving is timed."""

    def __init__(self, python: str) -> None:
        script = Path(__file__).with_name("peer_worker.py")
        self._process = subprocess.Popen(
            [python, str(script)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
            env=os.environ | ONE_THREAD,
        )
        self._folder = tempfile.TemporaryDirectory()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._process.communicate()
        self._folder.cleanup()

    def ask(self, solver: str, **job: Any) -> Answer:
        """The answer to one job."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        print(json.dumps({"solver": solver, **job}), file=self._process.stdin, flush=True)
        return dict(json.loads(self._process.stdout.readline()))

    def solve(self, solver: str, cells: int, tolerance: float) -> tuple[Answer, FloatArray | None]:
        """Answer and field of a peer."""
        output = f"{self._folder.name}/field.npy"
        found = self.ask(
            solver,
            cells=cells,
            tolerance=tolerance,
            width=WIDTH,
            radius=RADIUS,
            force=FORCE,
            modulus=YOUNG,
            poisson=0.0,
            friction=FRICTION,
            shear=SHARE * FRICTION * FORCE,
            approach=HERTZ.approach,
            output=output,
        )
        return found, None if "error" in found else np.load(output)


class Ours:
    """This project's solvers, with operators kept as a simulation keeps them."""

    def __init__(self) -> None:
        self.known: dict[int, tuple[Grid, Operators, FloatArray]] = {}
        self.pressed: dict[int, FloatArray] = {}

    def prepared(self, cells: int) -> tuple[Grid, Operators, FloatArray]:
        """Grid, operators and gap of one size."""
        if cells not in self.known:
            grid = Grid.square(cells, WIDTH)
            x, y = grid.points()
            self.known[cells] = grid, Operators((HalfSpace.from_young(YOUNG, 0.0),)), (x**2 + y**2) / (2.0 * RADIUS)
        return self.known[cells]

    def normal(self, cells: int, tolerance: float) -> tuple[Answer, FloatArray]:
        """A cold start, timed alone; ``setup`` is what a first solution takes longer."""
        fresh = cells not in self.known
        grid, operators, height = self.prepared(cells)
        begin = time.perf_counter()
        if fresh:
            solve_normal(operators, grid, height, force=FORCE, tolerance=tolerance)
        ready = time.perf_counter()
        found = solve_normal(operators, grid, height, force=FORCE, tolerance=tolerance)
        seconds = time.perf_counter() - ready
        setup = max(ready - begin - seconds, 0.0)
        return {"setup": setup, "seconds": seconds, "iterations": found.iterations}, found.pressure

    def friction(self, cells: int, tolerance: float) -> tuple[Answer, FloatArray]:
        """One step of tangential force from a pressed contact at rest."""
        grid, operators, height = self.prepared(cells)
        if cells not in self.pressed:
            self.pressed[cells] = solve_normal(operators, grid, height, force=FORCE, tolerance=1e-11).pressure
            self.friction(cells, tolerance)
        box = bounding_box(self.pressed[cells] > 0.0)
        part, limit = grid.part(box), FRICTION * self.pressed[cells][box]
        nothing = np.zeros((2, *part.shape))
        control = SolverControl(np.array([SHARE * FRICTION * FORCE, 0.0, 0.0]))
        begin = time.perf_counter()
        found = solve_tangential(operators.on(part), part.points(), limit, nothing, control, nothing, tolerance)
        seconds = time.perf_counter() - begin
        whole = np.zeros(grid.shape)
        whole[box] = found.traction[0]
        return {"setup": 0.0, "seconds": seconds, "iterations": found.iterations}, whole

    def solve(self, solver: str, cells: int, tolerance: float) -> tuple[Answer, FloatArray]:
        """Answer and field of one of the two problems."""
        return (self.friction if solver.endswith("friction") else self.normal)(cells, tolerance)


def distance(got: FloatArray, expected: FloatArray) -> float:
    """Relative L2 difference."""
    return float(np.linalg.norm(got - expected) / np.linalg.norm(expected))


def compare(
    problem: str, cells: int, solvers: dict[str, Solver], reference: FloatArray, exact: FloatArray, rounds: int
) -> Iterator[Run]:
    """All solvers at all tolerances, in turns."""
    solvers = dict(solvers)
    for tolerance in TOLERANCES[problem]:
        times: dict[str, list[Answer]] = {name: [] for name in solvers}
        fields: dict[str, FloatArray] = {}
        for _ in range(rounds):
            for name, solve in solvers.items():
                found, field = solve(name, cells, tolerance)
                if field is not None:
                    times[name].append(found)
                    fields[name] = field
        for name, field in fields.items():
            seconds = float(np.median([run["seconds"] for run in times[name]]))
            if seconds > TIME_LIMIT:
                del solvers[name]
            yield Run(
                problem,
                name,
                cells,
                tolerance,
                float(max(run["setup"] for run in times[name])),
                seconds,
                int(times[name][0]["iterations"]),
                distance(field, reference),
                distance(field, exact),
            )


def measure(worker: Worker, present: dict[str, str], grids: list[int], problems: list[str]) -> list[Run]:
    """The problems on every grid; partial slip on those from 128 to 256 cells."""
    ours, runs = Ours(), []
    normal = {OURS: ours.solve} | {p: worker.solve for p in PEERS[:4] if p in present}
    slip = {f"{OURS} friction": ours.solve} | {p: worker.solve for p in PEERS[4:] if p in present}
    closed = CattaneoMindlin(HERTZ, FRICTION, SHARE * FRICTION * FORCE)
    for cells in (cells for cells in grids if 128 <= cells <= 256 and "partial slip" in problems):
        _, tight = ours.friction(cells, 1e-11)
        exact = closed.traction(np.hypot(*ours.prepared(cells)[0].points()))
        runs += _printed(compare("partial slip", cells, slip, tight, exact, ROUNDS if cells < 256 else 1))
    ours.known.clear()  # set-up is timed too
    for cells in (cells for cells in grids if "normal contact" in problems):
        grid, operators, height = ours.prepared(cells)
        tight = solve_normal(operators, grid, height, force=FORCE, tolerance=1e-12).pressure
        del ours.known[cells]
        exact = HERTZ.pressure(np.hypot(*grid.points()))
        runs += _printed(compare("normal contact", cells, normal, tight, exact, ROUNDS if cells < 512 else 1))
    return [replace(run, solver=run.solver.removesuffix(" friction")) for run in runs]


def _printed(runs: Iterator[Run]) -> Iterator[Run]:
    for run in runs:
        print(
            f"{run.problem:15} {run.solver:18} {run.cells:4} {run.tolerance:7.0e} {1e3 * run.seconds:9.2f} ms "
            f"{run.iterations:5} its  error {run.algebraic:8.1e} (closed form {run.exact:8.1e})",
            flush=True,
        )
        yield run


def at_equal_error(runs: list[Run], target: float) -> dict[tuple[str, int, str], Run]:
    """The quickest run of each solver whose algebraic error is at most the target."""
    best: dict[tuple[str, int, str], Run] = {}
    for run in runs:
        key = (run.problem, run.cells, run.solver)
        if run.algebraic <= target and (key not in best or run.seconds < best[key].seconds):
            best[key] = run
    return best


def table(runs: list[Run], target: float) -> str:
    """Markdown: milliseconds of the solution at equal error, and how many times as long as ours."""
    best = at_equal_error(runs, target)
    solvers = list(dict.fromkeys(run.solver for run in runs))
    lines = [
        f"Solution time in ms at a relative L2 error of at most {target:.0e} (in brackets: times ours)",
        "",
        "| problem | cells | " + " | ".join(solvers) + " |",
        "|---|---|" + "---|" * len(solvers),
    ]
    for problem, cells in dict.fromkeys((run.problem, run.cells) for run in runs):
        ours = best.get((problem, cells, OURS))
        row = [f"{problem} | {cells}²"]
        for solver in solvers:
            run = best.get((problem, cells, solver))
            times = "" if run is None or ours is None else f" ({run.seconds / ours.seconds:.1f})"
            row.append("–" if run is None else f"{1e3 * run.seconds:.1f}{times}")
        lines.append("| " + " | ".join(row) + " |")
    return "\n".join(lines)


def features() -> str:
    """Markdown: what each solver has."""
    head = "| | Stiction | Tamaas | ContactMechanics | ASPHER |\n|---|---|---|---|---|\n"
    return head + "\n".join("| " + " | ".join(row) + " |" for row in FEATURES)


def draw(runs: list[Run], path: Path) -> None:
    """Error against time, one panel a problem and grid."""
    panels = list(dict.fromkeys((run.problem, run.cells) for run in runs))
    columns = min(3, len(panels))
    rows = -(-len(panels) // columns)
    figure = Figure(figsize=(4.6 * columns, 3.7 * rows + 0.4), layout="constrained")
    axes = figure.subplots(rows, columns, squeeze=False).ravel()
    names = list(dict.fromkeys(run.solver for run in runs))
    handles: dict[str, Line2D] = {}
    for panel, (problem, cells) in zip(axes, panels, strict=False):
        for number, name in enumerate(names):
            chosen = [r for r in runs if (r.problem, r.cells, r.solver) == (problem, cells, name)]
            if chosen:
                seconds, error = [1e3 * r.seconds for r in chosen], [r.algebraic for r in chosen]
                style = "osv^D"[number] + "-"
                (handles[name],) = panel.loglog(seconds, error, style, color=f"C{number}", markersize=4)
        exact = min(r.exact for r in runs if (r.problem, r.cells) == (problem, cells))
        handles["error of the grid itself"] = panel.axhline(exact, color="0.6", linestyle=":")
        panel.set_title(f"{problem}, {cells} × {cells} cells")
        panel.set_xlabel("time of the solution, ms")
        panel.set_ylabel("relative L2 error")
        panel.xaxis.set_minor_formatter(NullFormatter())
        panel.set_xlim(10 ** np.floor(np.log10(panel.get_xlim()[0])), 10 ** np.ceil(np.log10(panel.get_xlim()[1])))
        panel.grid(alpha=0.3)
    for panel in axes[len(panels) :]:
        panel.set_axis_off()
    figure.legend(handles.values(), handles.keys(), loc="outside lower center", ncols=len(handles))
    figure.savefig(path, dpi=130)


def main() -> None:
    """Measure, print tables, write JSON and the picture."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--peers-python", default=sys.executable, help="interpreter that has the peers")
    parser.add_argument("--output", type=Path, default=Path("benchmarks/results"))
    parser.add_argument("--cells", type=int, nargs="+", default=[64, 128, 256, 512], help="cells a side of the grids")
    parser.add_argument("--problems", nargs="+", choices=[*TOLERANCES], default=[*TOLERANCES])
    options = parser.parse_args()
    options.output.mkdir(parents=True, exist_ok=True)
    with Worker(options.peers_python) as worker:
        present = worker.ask("available")
        for peer in PEERS:
            if peer not in present:
                print(f"{peer} is not installed for {options.peers_python}: left out")
        runs = measure(worker, present, options.cells, options.problems)
    for target in TARGETS:
        print("\n" + table(runs, target))
    print("\n" + features())
    result = {"versions": present, "runs": [asdict(run) for run in runs]}
    (options.output / "contact_peers.json").write_text(json.dumps(result, indent=1), encoding="utf-8")
    draw(runs, options.output / "contact_peers.png")


if __name__ == "__main__":
    main()
