"""What load steps leave of error in loops: `python -m benchmarks.contact.loops [--cells N] [--finest N]`.

A sphere at ν = 0.45 is pressed, pulled, pulled back and pulled again, in even steps of the force or in equal steps of
the stick zone's radius c = a (1 − F/μF_N)^⅓ (Cattaneo; of half the change of force where it turns back). Errors of
displacement and force, the largest of the three ends of a pull, are against the latter in many more steps. Prints a
Markdown table; half a minute.
"""

import argparse
from itertools import pairwise

import numpy as np

from benchmarks.contact.accuracy import FORCE, POISSON, SLIDING, hertz_grid, relative, sphere
from slipcore.contact.elasticity.grid import Grid
from slipcore.contact.solver.problem import StepLoad
from slipcore.contact.solver.quasi_static import QuasiStatic
from slipcore.frames import FloatArray

SHARES = (0.6, 0.9)
"""Of the sliding force, where loops turn."""
STEPS = (6, 12, 24, 48)
"""Of each pull."""
WIDTH = 2.1
TOLERANCE = 1e-8


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


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cells", type=int, default=32, help="across the grid")
    parser.add_argument("--finest", type=int, default=200, help="steps of a pull that stand for the limit")
    options = parser.parse_args()
    grid = hertz_grid(options.cells, WIDTH)
    print(table([(share, *row) for share in SHARES for row in errors(grid, share, options.finest)]))


if __name__ == "__main__":
    main()
