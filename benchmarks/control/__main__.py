"""Grip control in closed loop: `python -m benchmarks.control [--seeds 100 50 10] [--page docs/accuracy-control.md]`.

Each strategy (benchmarks/control/strategies.py) does each task (benchmarks/control/tasks.py) in the reduced world, with
the real detector on noisy frames, from each seed (friction of the grasp, its field, noise). Writes control.json and
control.png. With `--keep FILE` outcomes are kept as they come, and a campaign that was stopped goes on. With
`--only STRATEGY …` the page's figures of the other strategies are kept as they are.
"""

import argparse
import json
import time
from collections.abc import Collection, Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from itertools import product
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from benchmarks.control.episodes import FRAME, Episode, Task, run, world_of
from benchmarks.control.outcomes import SIGNATURES, Outcome, median, outcome_of, scores
from benchmarks.control.strategies import BASELINES, CONTROLLERS, FIXED, MISLED, STRATEGIES, exploration, with_model
from benchmarks.control.tasks import ALL, LIFTS, PAPER, STEP, TASKS
from benchmarks.pages import options, picture_folder, save, table, write
from slipcore.contact.reduced import World
from stiction_client import Observation

SHOWN = ("known", "unknown", "model 40 % too high", f"fixed μ = {FIXED:g}", "slip reflex", "explored before")
"""Strategies in the picture."""
PANELS = (LIFTS[1], LIFTS[-1], *PAPER)

COLUMNS = {
    "strategy": "strategy",
    "held": "held",
    "crushed": "crushed",
    "peak": "peak overgrip",
    "final": "final overgrip",
    "as_asked": "% of them ≤ 1.3",
    "final_worst": "worst",
    "slip_mm": "slip, mm",
    "reaction_ms": "reaction, ms",
}

GROUPS = {f"{len(LIFTS)} lifts": LIFTS, **{task.name: (task,) for task in (*PAPER, STEP)}}
"""Columns of the table by task."""


def main() -> None:
    """Run, draw and write."""
    arguments = _arguments()
    groups = zip((CONTROLLERS, MISLED, BASELINES), arguments.seeds, strict=True)
    seeds = {name: number for names, number in groups for name in names if name in arguments.only}
    found = list(campaign(seeds, arguments.processes, arguments.keep))
    rows = [scores(name, _of(found, TASKS, name)) for name in seeds]
    by_task = {group: [scores(name, _of(found, tasks, name)) for name in seeds] for group, tasks in GROUPS.items()}
    step, looked = microseconds(), explorations(arguments.seeds[-1])
    save(draw(), picture_folder(arguments) / "control.png")
    tables = {
        "control": table(list(COLUMNS.values()), [[row[key] for key in COLUMNS] for row in rows]),
        "control tasks": _groups_table(seeds, by_task),
        "control controller": _controller_table(seeds, found),
        "control signatures": _signatures_table(seeds, found),
    }
    costs = {"episode_s": median([each.seconds for each in found]), "all_s": sum(each.seconds for each in found)}
    print(*tables.values(), f"a step: {step:.0f} µs of CPU time; an exploration: {looked:.2f} s", costs, sep="\n\n")
    numbers = {"seeds": seeds, "strategies": rows, "tasks": by_task, "lifts": _lifts(seeds, found), "cpu": costs}
    partly = len(seeds) < len(STRATEGIES)
    write(numbers | {"step_us": step, "exploration_s": looked}, tables, arguments, "control.json", partly)


def _arguments() -> argparse.Namespace:
    parser = options(__doc__)
    told = "episodes with each task of the controller, of the controller misled, and of what it is compared with"
    parser.add_argument("--seeds", type=int, nargs=3, default=(100, 50, 10), help=told)
    parser.add_argument("--processes", type=int, default=1, help="that share the episodes")
    parser.add_argument("--only", nargs="+", choices=list(STRATEGIES), default=list(STRATEGIES), metavar="STRATEGY")
    parser.add_argument("--keep", type=Path, help="file of outcomes, one a line; what it has is not run again")
    return parser.parse_args()


def campaign(seeds: dict[str, int], processes: int, keep: Path | None = None) -> Iterator[Outcome]:
    """Each task by each strategy, from as many ``seeds``; what is kept first."""
    kept = [] if keep is None or not keep.exists() else list(_read(keep.read_text(encoding="utf-8")))
    yield from (each for each in kept if each.seed < seeds.get(each.strategy, 0))
    done = {each[:3] for each in kept}
    jobs = []
    for seed, task in product(range(max(seeds.values())), range(len(ALL))):
        names = [name for name in seeds if seed < seeds[name] and (name, ALL[task].name, seed) not in done]
        jobs += [(task, seed, names)] if names else []
    with ProcessPoolExecutor(processes) as pool:
        for found in pool.map(_outcomes, jobs):
            if keep is not None:
                with keep.open("a", encoding="utf-8") as file:
                    file.writelines(json.dumps(each) + "\n" for each in found)
            yield from found


def _read(text: str) -> Iterator[Outcome]:
    return (Outcome(*json.loads(line)) for line in text.splitlines())


def _outcomes(job: tuple[int, int, Sequence[str]]) -> list[Outcome]:
    """One task from one seed by the strategies of these names, in one world."""
    index, seed, names = job
    task, found = ALL[index], []
    world = world_of(task, seed)
    for name in names:
        began = time.process_time()
        done = episode(task, name, seed, world)
        found.append(outcome_of(done, name, seed, time.process_time() - began))
    return found


def episode(task: Task, name: str, seed: int, world: World | None = None) -> Episode:
    """One task from one seed, by the strategy of this name at each finger; ``world``: the seed's, if it is at hand."""
    world, approach = world_of(task, seed) if world is None else world, STRATEGIES[name]
    each = [approach.make(task, world, finger) for finger in range(len(task.friction))]
    return run(task, world, each, seed, approach.missed)


def _of(found: Iterable[Outcome], tasks: Sequence[Task], name: str) -> list[Outcome]:
    names = {task.name for task in tasks}
    return [each for each in found if each.strategy == name and each.task in names]


def _cell(row: dict[str, object]) -> str:
    return f"{row['held']}, {row['final']:.2f}, {row['slip_mm']:.1f}".replace("nan", "–")


def _groups_table(names: Collection[str], by_task: dict[str, list[dict[str, object]]]) -> str:
    rows = [
        [name, *map(_cell, scored)] for name, scored in zip(names, zip(*by_task.values(), strict=True), strict=True)
    ]
    return table(["held, final overgrip, slip in mm", *by_task], rows)


def _lifts(names: Collection[str], found: Sequence[Outcome]) -> dict[str, list[dict[str, object]]]:
    """Scores of the controllers among ``names`` in each lift."""
    controllers = [name for name in CONTROLLERS | MISLED if name in names]
    return {task.name: [scores(name, _of(found, (task,), name)) for name in controllers] for task in LIFTS}


def _controller_table(names: Collection[str], found: Sequence[Outcome]) -> str:
    rows = [[task, *map(_cell, scored)] for task, scored in _lifts(names, found).items()]
    return table(["held, final overgrip, slip in mm", *(each for each in CONTROLLERS | MISLED if each in names)], rows)


def _signatures_table(names: Collection[str], found: Sequence[Outcome]) -> str:
    shown = [name for name in SHOWN if name in names]
    rows = [
        [each.name, *(each.tell([one.signature for one in _of(found, (each.task,), name)]) for name in shown)]
        for each in SIGNATURES
    ]
    return table(["median, episodes", *shown], rows)


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
    return median([exploration(world_of(task, seed), 0)[1] for task, seed in product(LIFTS, range(seeds))])


def draw() -> Figure:
    """Force over time of the first seed of some tasks, with the least that holds and the true stick ratio below it."""
    figure = Figure(figsize=(4.2 * 4, 9.4), layout="constrained")
    grid = figure.subplots(4, 4, sharex="col", height_ratios=(3, 1, 3, 1))
    for index, task in enumerate(PANELS):
        force, ratio = grid[2 * (index // 4), index % 4], grid[2 * (index // 4) + 1, index % 4]
        for colour, name in enumerate(SHOWN):
            shown = episode(task, name, 0)
            _plot(force, ratio, shown, name, f"C{colour}")
        force.plot(shown.time, shown.least[:, 0], "k:", label="least that holds")
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
