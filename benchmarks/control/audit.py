"""Closed loops on boundary elements: `python -m benchmarks.control.audit [--seeds 1] [--page PAGE]`, whose page is
docs/accuracy-control.md.

Episodes of benchmarks/control with one finger, repeated on boundary elements (benchmarks/control/elements.py) with
the same friction, noise and strategy: whether the object is held likewise, and under which force. How much of the
difference is chance, the same episodes in the reduced world with other noise tell. Writes control_audit.json and
control_audit.png.
"""

import time
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from itertools import islice, product
from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure

import slipcore.contact.reduced
from benchmarks.control import elements as control_elements
from benchmarks.control.episodes import Episode, Physics, run, world_of
from benchmarks.control.outcomes import HELD, median
from benchmarks.control.strategies import STRATEGIES
from benchmarks.control.tasks import TASKS
from benchmarks.pages import options, picture_folder, save, table, write

NAMES = ("known", "unknown", "model 40 % too high", "slip reflex")
ONE_FINGER = tuple(task for task in TASKS if len(task.friction) == 1)
CLOSE = 0.1
"""Of the final forces: what counts as the same."""
SHOWN = ((5, "unknown"), (3, "slip reflex"), (12, "known"), (15, "unknown"))
"""Tasks of ``ONE_FINGER`` and strategies in the picture."""

REDUCED: Physics = slipcore.contact.reduced  # type: ignore[assignment]
ELEMENTS: Physics = control_elements  # type: ignore[assignment]
_WITHIN = f"forces within {100.0 * CLOSE:.0f} %"
OTHER = 1000
"""By which the seed of other noise differs."""


class Repeat(NamedTuple):
    """One episode: slip, m, final force, N, and CPU s in the reduced world, on boundary elements, and in the reduced
    world with other noise.
    """

    task: str
    strategy: str
    seed: int
    slipped: tuple[float, float, float]
    final: tuple[float, float, float]
    seconds: tuple[float, float, float]

    def alike(self, other: int) -> bool:
        """Whether the object was held in both the first run and the ``other``, or in neither."""
        return (self.slipped[0] < HELD) == (self.slipped[other] < HELD)

    def ratio(self, other: int) -> float:
        """Final force of the ``other`` run over that of the first; NaN where either lost the object."""
        held = max(self.slipped[0], self.slipped[other]) < HELD
        return self.final[other] / self.final[0] if held else float("nan")


def main() -> None:
    """Run, draw and write."""
    parser = options(__doc__)
    parser.add_argument("--seeds", type=int, default=1, help="episodes of each strategy with each task")
    parser.add_argument("--processes", type=int, default=1, help="that share the episodes")
    arguments = parser.parse_args()
    jobs = list(product(range(len(ONE_FINGER)), NAMES, range(arguments.seeds)))
    with ProcessPoolExecutor(arguments.processes) as pool:
        found = list(pool.map(repeat, *zip(*jobs, strict=True)))
    groups = {name: [each for each in found if each.strategy == name] for name in NAMES} | {"all": found}
    columns = ["strategy", "both held or lost", "of them lost", _WITHIN, "median", "least", "most"]
    tables = {
        "control audit": table(
            [*columns, "by other noise: both held or lost", _WITHIN],
            [[name, *row(each, 1), *row(each, 2)[:3:2]] for name, each in groups.items()],
        )
    }
    odd = [each for each in found if not each.alike(1) or abs(each.ratio(1) - 1.0) > CLOSE]
    print(tables["control audit"], *odd, f"CPU s: {np.sum([each.seconds for each in found], axis=0)}", sep="\n")
    save(draw(), picture_folder(arguments) / "control_audit.png")
    episodes = [each._asdict() for each in found]
    write({"seeds": arguments.seeds, "episodes": episodes}, tables, arguments, "control_audit.json")


def runs(task: int, name: str, seed: int) -> Iterator[Episode]:
    """An episode in the reduced world, on boundary elements, and in the reduced world with other noise."""
    chosen, approach = ONE_FINGER[task], STRATEGIES[name]
    world = world_of(chosen, seed)
    for noise, physics in ((seed, REDUCED), (seed, ELEMENTS), (seed + OTHER, REDUCED)):
        yield run(chosen, world, [approach.make(chosen, world, 0)], noise, approach.missed, physics)


def repeat(task: int, name: str, seed: int) -> Repeat:
    """What counts of an episode's runs."""
    slipped, final, instants = [], [], [time.process_time()]
    for each in runs(task, name, seed):
        slipped.append(float(each.slipped[-1, 0]))
        final.append(float(each.normal[-1, 0]))
        instants.append(time.process_time())
    seconds = tuple(np.diff(instants).tolist())
    return Repeat(ONE_FINGER[task].name, name, seed, tuple(slipped), tuple(final), seconds)


def row(found: Sequence[Repeat], other: int) -> list[object]:
    """How many episodes end alike in the first run and the ``other``, and how far their forces are apart."""
    ratios = [ratio for each in found if np.isfinite(ratio := each.ratio(other))]
    alike = [each for each in found if each.alike(other)]
    close = f"{sum(abs(ratio - 1.0) <= CLOSE for ratio in ratios)}/{len(ratios)}"
    spread = [median(ratios), min(ratios, default=np.nan), max(ratios, default=np.nan)]
    return [f"{len(alike)}/{len(found)}", sum(each.slipped[0] >= HELD for each in alike), close, *spread]


def draw() -> Figure:
    """Force over time of some episodes in both worlds, with the least that holds, and slip below it."""
    figure = Figure(figsize=(4.2 * len(SHOWN), 5.0), layout="constrained")
    grid = figure.subplots(2, len(SHOWN), sharex="col", height_ratios=(3, 1))
    for (task, name), (force, slip) in zip(SHOWN, grid.T, strict=True):
        reduced, elements = islice(runs(task, name, 0), 2)
        for each, label, line in ((reduced, "reduced world", "-"), (elements, "boundary elements", "--")):
            force.plot(each.time, each.normal[:, 0], line, label=label, linewidth=1.4)
            slip.plot(each.time, 1e3 * each.slipped[:, 0], line, linewidth=1.4)
        force.plot(reduced.time, reduced.least[:, 0], "k:", label="least that holds")
        force.set(title=f"{ONE_FINGER[task].name}: {name}", ylabel="normal force, N", ylim=(0.0, None))
        slip.set(ylabel="slip, mm", xlabel="time, s", ylim=(0.0, max(slip.get_ylim()[1], 0.1)))
    handles, labels = grid[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=len(labels), frameon=False)
    return figure


if __name__ == "__main__":
    main()
