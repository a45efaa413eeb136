"""Grip control in closed loop: `python -m benchmarks.control [--seeds 3] [--output FOLDER] [--page docs/control.md]`.

Each strategy (benchmarks/control_strategies.py) does each task (benchmarks/control_tasks.py) in the reduced world, with
the real detector on noisy frames, from each seed (friction of the grasp, its field, noise). Writes control.json and
control.png.
"""

import argparse
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from itertools import product
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from benchmarks.control_episodes import FRAME, Episode, Task, run, world_of
from benchmarks.control_strategies import FIXED, STRATEGIES, exploration, with_model
from benchmarks.control_tasks import CUT, LIFTS, PAPER, SEATED, TASKS, TWIST
from benchmarks.pages import options, picture_folder, save, table, write
from stiction_client import Observation

HELD = 3e-3
"""m that an object may slip and still be held."""

SHOWN = ("known", "unknown", "model 40 % too high", f"fixed μ = {FIXED:g}", "slip reflex", "explored before")
"""Strategies in the picture."""
PANELS = (LIFTS[1], LIFTS[-1], *PAPER)

COLUMNS = {
    "strategy": "strategy",
    "held": "held",
    "crushed": "crushed",
    "peak": "peak overgrip",
    "final": "final overgrip",
    "final_worst": "worst",
    "slip_mm": "slip, mm",
    "reaction_ms": "reaction, ms",
}

Named = tuple[str, Episode]


def main() -> None:
    """Run, draw and write."""
    arguments = _arguments()
    episodes = list(every_episode(arguments.seeds, arguments.processes))
    rows = [scores(name, [each for other, each in episodes if other == name]) for name in STRATEGIES]
    by_task = {group: _by_strategy(episodes, tasks) for group, tasks in GROUPS.items()}
    step, looked = microseconds(), explorations(arguments.seeds)
    save(draw(episodes), picture_folder(arguments) / "control.png")
    tables = {"control": table(list(COLUMNS.values()), [[row[key] for key in COLUMNS] for row in rows])}
    tables["control tasks"] = _tasks_table(by_task)
    tables["control signatures"] = _signatures_table(episodes)
    print(*tables.values(), f"a step: {step:.0f} µs of CPU time; an exploration: {looked:.2f} s", sep="\n\n")
    numbers = {"seeds": arguments.seeds, "strategies": rows, "tasks": by_task, "step_us": step, "exploration_s": looked}
    write(numbers, tables, arguments, "control.json")


def _arguments() -> argparse.Namespace:
    parser = options(__doc__)
    parser.add_argument("--seeds", type=int, default=3, help="episodes of each strategy with each task")
    parser.add_argument("--processes", type=int, default=1, help="that share the episodes")
    return parser.parse_args()


def every_episode(seeds: int, processes: int) -> Iterator[Named]:
    """Each task from each seed, by each strategy."""
    jobs = list(product(range(len(TASKS)), range(seeds)))
    with ProcessPoolExecutor(processes) as pool:
        for found in pool.map(_episodes, *zip(*jobs, strict=True)):
            yield from found


def _episodes(task: int, seed: int) -> list[Named]:
    return [(name, episode(TASKS[task], name, seed)) for name in STRATEGIES]


def episode(task: Task, name: str, seed: int) -> Episode:
    """One task from one seed, by the strategy of this name at each finger."""
    world, approach = world_of(task, seed), STRATEGIES[name]
    each = [approach.make(task, world, finger) for finger in range(len(task.friction))]
    return run(task, world, each, seed, approach.missed)


def scores(name: str, episodes: list[Episode]) -> dict[str, object]:
    """How many held, and how many of those that break were crushed; of what was held, median peak and final force, and
    the largest final one, over the least that hold; largest slip; and the longest time, ms, in which a force was below
    the least (how late a strategy reacts).
    """
    held = [each for each in episodes if each.slipped[-1].max() < HELD]
    fragile = [each for each in episodes if np.isfinite(each.limit)]
    final = [each.normal[-1].sum() / each.least[-1].sum() for each in held]
    return {
        "strategy": name,
        "held": f"{len(held)}/{len(episodes)}",
        "crushed": f"{sum(bool((each.normal > each.limit).any()) for each in fragile)}/{len(fragile)}",
        "peak": _median([each.normal.sum(axis=1).max() / each.least.sum(axis=1).max() for each in held]),
        "final": _median(final),
        "final_worst": max(final, default=float("nan")),
        "slip_mm": 1e3 * max(float(each.slipped[-1].max()) for each in episodes),
        "reaction_ms": 1e3 * max(_late(each) for each in episodes),
    }


def _median(values: Sequence[float]) -> float:
    return float(np.median(values)) if values else float("nan")


def _late(episode: Episode) -> float:
    """The longest time, s, in which the fingers together press with less than the least."""
    below = episode.normal.sum(axis=1) < episode.least.sum(axis=1)
    ends = np.flatnonzero(np.diff(np.concatenate([[0], below.astype(np.int8), [0]])))
    return float(max(ends[1::2] - ends[::2], default=0)) * FRAME


GROUPS = {f"{len(LIFTS)} lifts": LIFTS, **{task.name: (task,) for task in PAPER}}
"""Rows of the table by task."""


def _of(episodes: list[Named], tasks: Sequence[Task], name: str) -> list[Episode]:
    return [each for other, each in episodes if other == name and each.task in {task.name for task in tasks}]


def _by_strategy(episodes: list[Named], tasks: Sequence[Task]) -> list[dict[str, object]]:
    return [scores(name, _of(episodes, tasks, name)) for name in STRATEGIES]


def _tasks_table(by_task: dict[str, list[dict[str, object]]]) -> str:
    rows = [
        [name, *(f"{row['held']}, {row['final']:.2f}, {row['slip_mm']:.1f}" for row in scored)]
        for name, scored in zip(STRATEGIES, zip(*by_task.values(), strict=True), strict=True)
    ]
    return table(["held, final overgrip, slip in mm", *by_task], rows)


class Signature(NamedTuple):
    """What the paper tells of a task: a ``ratio`` of forces of an episode, to lie between ``low`` and ``high``."""

    name: str
    task: Task
    ratio: Callable[[Episode], float]
    low: float
    high: float

    def tell(self, episodes: Sequence[Episode]) -> str:
        """The median ratio, and in how many episodes it is as the paper says."""
        ratios = [self.ratio(each) for each in episodes]
        return f"{np.median(ratios):.2f}, {sum(self.low < ratio < self.high for ratio in ratios)}/{len(ratios)}"


def _at(episode: Episode, time_: float) -> float:
    return float(np.interp(time_, episode.time, episode.normal[:, 0]))


def _fast_over_gradual(episode: Episode) -> float:
    """Rates of the force while the thread takes up the torque, and while it draws tighter; 0 where it doesn't rise."""
    fast = (_at(episode, SEATED + 0.1) - _at(episode, TWIST)) / (SEATED + 0.1 - TWIST)
    gradual = (_at(episode, SEATED + 3.0) - _at(episode, SEATED + 0.6)) / 2.4
    return fast / gradual if gradual > 0.0 else 0.0


def _after_over_before(episode: Episode) -> float:
    return _at(episode, episode.time[-1]) / _at(episode, CUT - 0.1)


def _front_over_back(episode: Episode) -> float:
    return float(episode.normal[-1, 0] / episode.normal[-1, -1])


_SUDDEN, _SHELL, _CUP, _CAP, _BLOCK, _KNIFE = PAPER
SIGNATURES = (
    Signature("cap: rate of the fast over that of the gradual rise, above 2", _CAP, _fast_over_gradual, 2.0, np.inf),
    Signature("knife: force at the end over that before the cut, below 1", _KNIFE, _after_over_before, 0.0, 1.0),
    Signature("block: slippery over rough face at the end, above 1.1", _BLOCK, _front_over_back, 1.1, np.inf),
)


def _signatures_table(episodes: list[Named]) -> str:
    rows = [[each.name, *(each.tell(_of(episodes, (each.task,), name)) for name in SHOWN)] for each in SIGNATURES]
    return table(["median, episodes", *SHOWN], rows)


def microseconds() -> float:
    """CPU time of a controller's step with a model, under a load with torque."""
    task = LIFTS[5]
    strategy = with_model(1.0, task, world_of(task, 0), 0)
    frames = [Observation(count * FRAME, 4.0, 1.2, 1e-3, 0.4) for count in range(1, 5001)]
    began = time.process_time()
    for frame in frames:
        strategy(frame)
    return 1e6 * (time.process_time() - began) / len(frames)


def explorations(seeds: int) -> float:
    """Median time, s, of the exploration before a task."""
    return _median([exploration(world_of(task, seed), 0)[1] for task, seed in product(LIFTS, range(seeds))])


def draw(episodes: list[Named]) -> Figure:
    """Force over time of the first seed of some tasks, with the least that holds and the true stick ratio below it."""
    figure = Figure(figsize=(4.2 * 4, 9.4), layout="constrained")
    grid = figure.subplots(4, 4, sharex="col", height_ratios=(3, 1, 3, 1))
    for index, task in enumerate(PANELS):
        force, ratio = grid[2 * (index // 4), index % 4], grid[2 * (index // 4) + 1, index % 4]
        for colour, name in enumerate(SHOWN):
            _plot(force, ratio, _of(episodes, (task,), name)[0], name, f"C{colour}")
        least = _of(episodes, (task,), SHOWN[0])[0]
        force.plot(least.time, least.least[:, 0], "k:", label="least that holds")
        if np.isfinite(task.limit):
            force.axhline(task.limit, color="k", linewidth=0.8, linestyle="-.", label="breaks")
        force.set(title=task.name, ylabel="normal force, N", ylim=(0.0, None))
        ratio.set(ylabel="stick ratio", ylim=(0.0, 1.05), xlabel="time, s")
    handles, labels = grid[0, 3].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=len(labels), frameon=False)
    return figure


def _plot(force: Axes, ratio: Axes, episode: Episode, name: str, colour: str) -> None:
    """The fingers of one episode, the second one dashed."""
    for finger, line in zip(range(episode.normal.shape[1]), ("-", "--"), strict=False):
        label = name if finger == 0 else None
        force.plot(episode.time, episode.normal[:, finger], colour, label=label, linewidth=1.2, linestyle=line)
        ratio.plot(episode.time, episode.stick_ratio[:, finger], colour, linewidth=0.8, linestyle=line)


if __name__ == "__main__":
    main()
