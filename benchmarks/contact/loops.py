"""What load steps leave of error in presses and loops: `python -m benchmarks.contact.loops [--cells N] [--finest N]`.

A sphere at ν = 0.45 is pressed, pulled, pulled back and pulled again, in even steps of the force or in equal steps of
the stick zone's radius c = a (1 − F/μF_N)^⅓ (Cattaneo; of half the change of force where it turns back). Errors of
displacement and force, the largest of the three ends of a pull, are against the latter in many more steps.

Then scenes in the steps that the library takes, of few frames a pull: errors over time at the sensor's points against
twelve steps a frame. Prints two Markdown tables; two minutes.
"""

import argparse
from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise

import numpy as np

from benchmarks.contact.accuracy import FORCE, POISSON, SLIDING, hertz_grid, relative, sphere
from slipcore.contact.effects import (
    FiniteLayer,
    LoadPath,
    NormalTangentialCoupling,
    SensorSampling,
    TangentialLoad,
)
from slipcore.contact.elasticity.grid import Grid
from slipcore.contact.plan.plan import Effect
from slipcore.contact.scene import Finger, Press, Scene
from slipcore.contact.solver.problem import StepLoad
from slipcore.contact.solver.quasi_static import QuasiStatic
from slipcore.contact.tiers.boundary_elements import Fidelity, run
from slipcore.contact.tiers.difference import difference
from slipcore.contact.tiers.probe import probe
from slipcore.frames import FloatArray

SHARES = (0.6, 0.9)
"""Of the sliding force, where loops turn."""
STEPS = (6, 12, 24, 48)
"""Of each pull."""
WIDTH = 2.1
TOLERANCE = 1e-8

SENSOR = SensorSampling((12, 12), 1e-3, 10.0)
"""Six frames a pull, three for a grip that loosens."""
SUBSTEPS, FINEST_SUBSTEPS = (1, 2, 4), 12
"""Load steps a frame at least."""
LOOP = LoadPath((0.5, 1.1, 1.7, 2.3), force_x=(0.0, 3.4, -3.4, 3.4))
GRIP = LoadPath((0.5, 0.8, 1.1, 1.4, 1.7), force_x=(0.0, 1.6, 1.6, 1.6, 1.6), normal_force=(0.0, 0.0, -5.5, 0.0, -5.5))
"""At 4.5 N sliding begins at 1.8 N."""
LAYER = (FiniteLayer(5e-3), NormalTangentialCoupling())
COUPLED = (NormalTangentialCoupling(),)
TWIST = 0.85
"""Of the sliding moment."""


def even(steps: int, _share: float) -> FloatArray:
    """Parts of a pull after each step: of equal force."""
    return np.linspace(0.0, 1.0, steps + 1)


def by_front(steps: int, share: float) -> FloatArray:
    """The same of equal change of the stick zone's radius."""
    radii = np.linspace(1.0, np.cbrt(1.0 - share), steps + 1)
    return np.asarray((1.0 - radii**3) / share)


def ends(grid: Grid, share: float, parts: FloatArray) -> list[tuple[FloatArray, FloatArray]]:
    """Displacement and force [2, ny, nx] at the end of each pull of a loop."""
    solver, found = QuasiStatic(sphere(POISSON), grid, TOLERANCE, 1e-2 * TOLERANCE, second_order=True), []
    state, _ = solver.step(solver.start(), StepLoad(FORCE))
    for begin, end in pairwise((0.0, share, -share, share)):
        for before, now in pairwise(parts):
            force = SLIDING * (begin + (end - begin) * now)
            load = StepLoad(FORCE, tangential=np.array([force, 0.0, 0.0]), duration=now - before)
            state, result = solver.step(state, load)
        found.append((result.displacement[:2], result.force[:2]))
    return found


def errors(grid: Grid, share: float, finest: int) -> list[tuple[str, int, float, float]]:
    """For each way and number of steps the relative errors of displacement and force."""
    exact, rows = ends(grid, share, by_front(finest, share)), []
    for name, parts in (("of equal force", even), ("of equal radius", by_front)):
        for steps in STEPS:
            pairs = zip(ends(grid, share, parts(steps, share)), exact, strict=True)
            displacement, force = np.max(
                [[relative(*both) for both in zip(*pair, strict=True)] for pair in pairs], axis=0
            )
            rows.append((name, steps, float(displacement), float(force)))
    return rows


def table(rows: list[tuple[float, str, int, float, float]]) -> str:
    """Markdown, with the orders since the row before."""
    lines = ["| turns at | steps | a pull | displacement | order | force | order |", "|---" * 7 + "|"]
    before: tuple[float, float] | None = None
    for share, name, steps, *found in rows:
        known = before if steps != STEPS[0] else None
        orders = [
            "" if known is None else f"{np.log2(was / now):.2f}" for was, now in zip(known or found, found, strict=True)
        ]
        lines.append(
            f"| {share} μF_N | {name} | {steps} | {found[0]:.1e} | {orders[0]} | {found[1]:.1e} | {orders[1]} |"
        )
        before = found[0], found[1]
    return "\n".join(lines)


def scene(name: str, poisson: float, duration: float, *effects: Effect) -> Scene:
    """Pressed with 10 N in half a second, friction 0.4."""
    return Scene(name, (*effects, SENSOR), Finger(poisson_ratio=poisson), press=Press(FORCE, 0.5), duration=duration)


def twisted() -> Scene:
    """A loop of moments."""
    moment = TWIST * SLIDING * probe(scene("press", POISSON, 0.5, TangentialLoad((1.0, 0.0))).plan()).lever
    loop = replace(LOOP, force_x=(), moment=(0.0, moment, -moment, moment))
    return scene(f"loop of moments to {TWIST} of sliding, ν = {POISSON}", POISSON, 2.3, loop)


def scenes() -> Iterator[Scene]:
    """Presses and loops close to sliding."""
    yield from (
        scene(f"press, coupled, ν = {POISSON}", POISSON, 0.5, *COUPLED),
        scene("press, bonded layer, ν = 0.49", 0.49, 0.5, *LAYER),
        scene(f"loop to 0.85 μF_N, ν = {POISSON}", POISSON, 2.3, LOOP),
        scene("loop to 0.85 μF_N, bonded layer, ν = 0.49", 0.49, 2.3, LOOP, *LAYER),
        twisted(),
        scene(f"grip loosens to 0.89 of sliding, twice, ν = {POISSON}", POISSON, 1.7, GRIP),
        scene("grip loosens so, bonded layer, ν = 0.49", 0.49, 1.7, GRIP, *LAYER),
    )


def scene_rows(case: Scene, cells: int) -> Iterator[tuple[str, int, float, float]]:
    """Load steps of a scene, and the relative errors of displacement and force, over time."""
    plan = case.plan()
    fine = run(plan, Fidelity(cells, FINEST_SUBSTEPS, 1e-6, aligned=False))
    for substeps in SUBSTEPS:
        log = run(plan, Fidelity(cells, substeps, 1e-6, aligned=False))
        error = difference(log, fine)
        yield case.name, int(log.metadata["steps"]), error.displacement, error.force


def scene_table(rows: list[tuple[str, int, float, float]]) -> str:
    """Markdown, with the orders since the row before of the scene."""
    lines = ["| scene | steps | displacement | order | force | order |", "|---" * 6 + "|"]
    for before, (name, steps, *errors) in zip([None, *rows], rows, strict=False):
        orders = ["", ""]
        if before is not None and before[0] == name:
            growth = np.log(steps / before[1])
            orders = [f"{np.log(was / now) / growth:.2f}" for was, now in zip(before[2:], errors, strict=True)]
        lines.append(f"| {name} | {steps} | {errors[0]:.1e} | {orders[0]} | {errors[1]:.1e} | {orders[1]} |")
    return "\n".join(lines)


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cells", type=int, default=32, help="across the grid")
    parser.add_argument("--finest", type=int, default=200, help="steps of a pull that stand for the limit")
    options = parser.parse_args()
    grid = hertz_grid(options.cells, WIDTH)
    print(table([(share, *row) for share in SHARES for row in errors(grid, share, options.finest)]))
    print()
    print(scene_table([row for case in scenes() for row in scene_rows(case, options.cells)]))


if __name__ == "__main__":
    main()
