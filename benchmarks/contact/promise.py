"""Does `simulate` keep the accuracy that it is asked for? `python -m benchmarks.contact.promise --output FOLDER`.

Boundary elements are asked for several accuracies, on random presses and pulls of a sphere at ν = 0, whose closed form
is the truth, and on the library's scenes, against a run on 150 cells across the contact with two load steps a frame.
Writes contact_promise.json (each case as soon as it is known; what is there already is not run again) and
contact_promise.png, and prints a Markdown table. The whole takes half an hour.

`--requests N` asks N random scenes over all effects instead, the cheapest first, against runs on two to four times the
cells (random_requests.json, kept and gone on with likewise): how often the estimate lies within a factor of three of
the true error. `--budgets N` asks N of them for the best log in `--budget` processor seconds: how much of these is
used. `--first 10000` takes seeds that are there for choosing defaults.
"""

import argparse
import json
import time
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from benchmarks.contact import random_requests
from slipcore.contact.effects import LoadPath, SensorSampling, SphereSurface
from slipcore.contact.plan.plan import Plan
from slipcore.contact.scene import Finger, Press, Scene, library
from slipcore.contact.tiers import boundary_elements, closed_form
from slipcore.contact.tiers.accuracy import difference, simulate_to
from slipcore.contact.tiers.boundary_elements import Fidelity
from slipcore.contact.tiers.sampling import frame_times
from slipcore.frames import GraspLog

ASKED = (0.1, 0.05, 0.02, 0.01)
"""The last of spheres only: a fine run is hardly that accurate itself."""
SPHERES = 30
TUNED_ON = ("table1_condition1", "table1_condition4")
"""Scenes that the estimate's margin was chosen with: they do not count."""
MOST_FRAMES = 61
"""Longer scenes, and the coupled one, would take most of an hour for their fine run."""
FINE = Fidelity(cells=150, substeps=2, tolerance=1e-5)
LEAST_KEPT, LARGEST_RATIO = 0.95, 3.0


@dataclass(frozen=True, slots=True)
class AccuracyRequest:
    """One request: the accuracy ``asked``, ``estimated`` and ``true``, and the processor ``seconds`` it took."""

    case: str
    asked: float
    estimated: float
    true: float
    seconds: float
    cells: int


def sphere(seed: int) -> Scene:
    """A sphere of random curvature, pressed, pulled and half the time pulled back, below sliding, at ν = 0."""
    rng = np.random.default_rng([20261121, seed])
    force, curvature, share = rng.uniform(2.0, 20.0), rng.uniform(0.0, 60.0), rng.uniform(0.2, 0.97, 2)
    back = -share[1] if seed % 2 else share[0]
    pulls = (0.0, share[0] * 0.4 * force, back * 0.4 * force)
    path = LoadPath((1.0, 1.5, 2.0), force_x=tuple(float(pull) for pull in pulls))
    effects = (path, SphereSurface(curvature), SensorSampling())
    return Scene(f"sphere {seed}", effects, finger=Finger(poisson_ratio=0.0), press=Press(force, 1.0))


def cases() -> Iterator[tuple[str, Plan, Callable[[], GraspLog]]]:
    """Name, plan and truth of each case."""
    for seed in range(SPHERES):
        scene = sphere(seed)
        plan = scene.plan()
        yield scene.name, plan, lambda scene=scene, plan=plan: closed_form.run(scene, plan)
    for name in library():
        plan = Scene.from_toml(name).plan()
        if name in TUNED_ON or plan.problem.coupled or len(frame_times(plan)) > MOST_FRAMES:
            continue
        yield name, plan, lambda plan=plan: boundary_elements.run(plan, FINE)


def ask(name: str, plan: Plan, truth: GraspLog, asked: float) -> AccuracyRequest:
    """One request against the truth."""
    began = time.process_time()
    found = simulate_to(plan, accuracy=asked)
    seconds = time.process_time() - began
    true = difference(found.log, truth).largest
    return AccuracyRequest(name, asked, found.error.largest, true, seconds, found.fidelity.cells)


def campaign(path: Path) -> list[AccuracyRequest]:
    """All requests; those in ``path`` are not made again."""
    known = [AccuracyRequest(**entry) for entry in json.loads(path.read_text())] if path.exists() else []
    done = {(promise.case, promise.asked) for promise in known}
    for name, plan, truth in cases():
        wanted = ASKED if name.startswith("sphere ") else ASKED[:-1]
        missing = [asked for asked in wanted if (name, asked) not in done]
        if not missing:
            continue
        exact = truth()
        for asked in missing:
            known.append(ask(name, plan, exact, asked))
            path.write_text(json.dumps([asdict(promise) for promise in known], indent=1))
        print(f"{name}: " + ", ".join(f"{p.asked:g} -> {p.true:.4f}" for p in known if p.case == name), flush=True)
    return known


def table(promises: list[AccuracyRequest]) -> str:
    """For each accuracy and kind of truth: how often it was kept, how far the worst was off, what it took."""
    lines = ["| truth | asked | cases | kept | worst true/asked | median true/asked | median seconds |"]
    lines.append("|---|---|---|---|---|---|---|")
    for kind, spheres in (("closed form", True), ("fine run", False)):
        for asked in ASKED:
            own = [p for p in promises if p.asked == asked and p.case.startswith("sphere ") == spheres]
            ratio = np.array([p.true / p.asked for p in own])
            if own:
                lines.append(
                    f"| {kind} | {asked:g} | {len(own)} | {100 * (ratio <= 1).mean():.0f} % | {ratio.max():.2f} "
                    f"| {np.median(ratio):.2f} | {np.median([p.seconds for p in own]):.1f} |"
                )
    return "\n".join(lines)


def picture(promises: list[AccuracyRequest]) -> Figure:
    """True error over the asked one, with what is promised."""
    figure = Figure(figsize=(7.0, 4.2), layout="constrained")
    axes = figure.subplots()
    for spheres, label, shift in ((True, "spheres, closed form", 0.96), (False, "library, fine run", 1.04)):
        own = [p for p in promises if p.case.startswith("sphere ") == spheres]
        axes.loglog([shift * p.asked for p in own], [p.true for p in own], "o", ms=4, alpha=0.6, label=label)
    asked = np.array([min(ASKED) / 1.5, max(ASKED) * 1.5])
    axes.loglog(asked, asked, "k-", lw=1, label="asked (95 % below)")
    axes.loglog(asked, LARGEST_RATIO * asked, "k--", lw=1, label="three times that (all below)")
    axes.set(xlabel="accuracy asked", ylabel="true error")
    axes.grid(visible=True, which="both", alpha=0.3)
    axes.legend(fontsize=8)
    return figure


def main() -> None:
    """Run, write, print; fails where the promise is not kept."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--output", type=Path, default=Path("benchmark-output"))
    parser.add_argument("--requests", type=int, default=0, help="ask so many random scenes instead")
    parser.add_argument("--budgets", type=int, default=0, help="ask so many random scenes for the best in --budget")
    parser.add_argument("--budget", type=float, default=4.0, help="processor seconds of each of these")
    parser.add_argument("--kind", choices=("all", *random_requests.KINDS), default="all", help="only scenes with this")
    parser.add_argument("--first", type=int, default=0, help=f"seed; from {random_requests.TUNING} on for tuning")
    parser.add_argument("--cap", type=float, default=60.0, help="processor seconds a random scene")
    parser.add_argument("--seconds", type=float, default=np.inf, help="processor seconds of all random scenes")
    options = parser.parse_args()
    options.output.mkdir(parents=True, exist_ok=True)
    if options.requests > 0:
        drawn, path = range(options.first, options.first + options.requests), options.output / "random_requests.json"
        seeds = [seed for seed in drawn if options.kind in ("all", *random_requests.kinds_of(seed))]
        print(random_requests.table(random_requests.requests(path, seeds, options.cap, options.seconds), seeds))
        return
    if options.budgets > 0:
        seeds = range(options.first, options.first + options.budgets)
        made = (random_requests.budget_request(seed, options.budget) for seed in seeds)
        print(random_requests.budget_table([entry for entry in made if entry is not None]))
        return
    promises = campaign(options.output / "contact_promise.json")
    picture(promises).savefig(options.output / "contact_promise.png", dpi=100)
    print(table(promises))
    ratio = np.array([p.true / p.asked for p in promises])
    print(f"\nin all: {100 * (ratio <= 1.0).mean():.1f} % kept, worst {ratio.max():.2f} times what was asked")
    if (ratio <= 1.0).mean() < LEAST_KEPT or ratio.max() > LARGEST_RATIO:
        raise SystemExit("the promise is not kept")


if __name__ == "__main__":
    main()
