"""Grip control in closed loop: `python -m benchmarks.control [--seeds 3] [--output FOLDER] [--page docs/control.md]`.

Each strategy does each task of benchmarks/control_tasks.py in the reduced world, with the real detector on noisy
frames, from each seed (friction of the grasp, its field, noise). Writes control.json and control.png.
"""

import argparse
import dataclasses
import time
from collections.abc import Callable, Iterator
from functools import partial

import numpy as np
from matplotlib.figure import Figure

from benchmarks.control_tasks import BETWEEN, FRAME, START, TASKS, Episode, Strategy, Task, contact_of, run, world_of
from benchmarks.pages import options, picture_folder, save, table, write
from slipcore.contact.reduced import World
from stiction_client import ControllerState, ControlSettings, Cost, Domain, FrictionModel, GraspController, Observation
from stiction_client.controller.load import Load

MOST = 30.0
"""N of the gripper."""
FIXED = 0.2
"""Friction of the fixed strategy."""
LOST = 3e-3
"""m that an object may slip and still be held."""
SHOWN = ("known", "unknown", "model 40 % too high", f"fixed μ = {FIXED:g}", "stick ratio alone")
"""Strategies in the picture."""


def main() -> None:
    """Run, draw and write."""
    parser = options(__doc__)
    parser.add_argument("--seeds", type=int, default=3, help="episodes of each strategy with each task")
    arguments = parser.parse_args()
    episodes = list(_episodes(arguments))
    rows = [scores(name, [episode for other, episode in episodes if other == name]) for name in STRATEGIES]
    by_task = {
        task.name: [
            scores(name, [each for other, each in episodes if other == name and each.task is task])
            for name in STRATEGIES
        ]
        for task in TASKS
    }
    step = microseconds()
    save(draw([each for each in episodes if each[0] in SHOWN]), picture_folder(arguments) / "control.png")
    tables = {"control": table(list(COLUMNS.values()), [[row[key] for key in COLUMNS] for row in rows])}
    tables["control tasks"] = _tasks_table(by_task)
    print(tables["control"], tables["control tasks"], f"a step: {step:.0f} µs of CPU time", sep="\n\n")
    numbers = {"seeds": arguments.seeds, "strategies": rows, "tasks": by_task, "step_us": step}
    write(numbers, tables, arguments, "control.json")


def _episodes(arguments: argparse.Namespace) -> Iterator[tuple[str, Episode]]:
    for task in TASKS:
        for seed in range(arguments.seeds):
            world = world_of(task.friction, seed)
            for name, make in STRATEGIES.items():
                yield name, run(task, world, make(task, world), seed)


@dataclasses.dataclass
class Controlled:
    """A ``GraspController`` and its state."""

    state: ControllerState

    def __call__(self, seen: Observation) -> float:
        """Its command."""
        self.state, command = GraspController.step(self.state, seen)
        return command.normal_force


@dataclasses.dataclass
class Fixed:
    """As hard as one fixed friction asks for under the load to come, with the controller's lead and rates."""

    settings: ControlSettings
    load: Load = dataclasses.field(default_factory=Load)
    time: float = 0.0
    force: float = START

    def __call__(self, seen: Observation) -> float:
        """Its command."""
        elapsed, self.time = seen.time - self.time, seen.time
        self.load = self.load.step(seen, elapsed, self.settings)
        slowest = self.force * (1.0 - self.settings.fall_rate * elapsed)
        self.force = min(max(self.load.lead(self.settings) / FIXED, slowest, START), MOST)
        return self.force


def settings_of(world: World, **changed: float) -> ControlSettings:
    """The controller's defaults for this finger."""
    return ControlSettings(contact=contact_of(world), least_force=START, most_force=MOST, **changed)  # type: ignore[arg-type]


def model_of(friction: float, world: World) -> FrictionModel:
    """A model that knows the material's mean and its scatter from grasp to grasp."""
    return FrictionModel(
        material="material",
        method="hierarchical",
        version=1,
        coefficients=np.array([friction, 0.0, 0.0]),
        covariance=np.zeros((3, 3)),
        scale=BETWEEN,
        n=10_000,
        degrees_of_freedom=np.inf,
        scatter_degrees_of_freedom=np.inf,
        domain=Domain((0.0, 0.01), (0.0, 1.0)),
        identifiable=np.ones(3, bool),
        element_area=world.element_area,
        cost=Cost(0.0),
    )


def with_model(factor: float, task: Task, world: World) -> Strategy:
    """The controller with the material's friction, or ``factor`` times it."""
    return Controlled(GraspController.init(settings_of(world), model_of(factor * task.friction, world)))


def without_model(task: Task, world: World) -> Strategy:  # noqa: ARG001 - all strategies are made alike
    """The controller on an unknown material."""
    return Controlled(GraspController.init(settings_of(world)))


def by_stick_ratio(task: Task, world: World) -> Strategy:  # noqa: ARG001
    """The stick ratio held at 0.7, nothing learnt."""
    alone = settings_of(world, feel_stick_ratio=0.7, learn_stick_ratio=0.7, learn_frames=1000, unknown_friction=10.0)
    return Controlled(GraspController.init(alone))


def fixed(task: Task, world: World) -> Strategy:  # noqa: ARG001
    """One low friction for all materials."""
    return Fixed(settings_of(world))


STRATEGIES: dict[str, Callable[[Task, World], Strategy]] = {
    "known": partial(with_model, 1.0),
    "unknown": without_model,
    "model 40 % too high": partial(with_model, 1.4),
    "model 40 % too low": partial(with_model, 0.6),
    f"fixed μ = {FIXED:g}": fixed,
    "stick ratio alone": by_stick_ratio,
}

COLUMNS = {
    "strategy": "strategy",
    "held": "held",
    "peak": "peak overgrip",
    "final": "final overgrip",
    "slip_mm": "slip, mm",
    "reaction_ms": "reaction, ms",
}


def scores(name: str, episodes: list[Episode]) -> dict[str, object]:
    """Held; of those that held, median peak and final force over the least that hold; largest slip; and the longest
    time, ms, in which the force was below the least (how late a strategy reacts).
    """
    held = [episode for episode in episodes if episode.slipped[-1] < LOST]
    return {
        "strategy": name,
        "held": f"{len(held)}/{len(episodes)}",
        "peak": _median([max(each.normal) / max(each.least) for each in held]),
        "final": _median([each.normal[-1] / each.least[-1] for each in held]),
        "final_worst": max((each.normal[-1] / each.least[-1] for each in held), default=float("nan")),
        "slip_mm": 1e3 * max(each.slipped[-1] for each in episodes),
        "reaction_ms": 1e3 * max(_late(each) for each in episodes),
    }


def _median(values: list[float]) -> float:
    return float(np.median(values)) if values else float("nan")


def _late(episode: Episode) -> float:
    """The longest time, s, below the least force."""
    longest = run_ = 0
    for normal, least in zip(episode.normal, episode.least, strict=True):
        run_ = run_ + 1 if normal < least else 0
        longest = max(longest, run_)
    return longest * FRAME


def _tasks_table(by_task: dict[str, list[dict[str, object]]]) -> str:
    rows = [
        [task, *(f"{row['held']}, {row['final']:.2f}, {row['slip_mm']:.1f}" for row in scored)]
        for task, scored in by_task.items()
    ]
    return table(["held, final overgrip, slip in mm", *STRATEGIES], rows)


def microseconds() -> float:
    """CPU time of a controller's step with a model, under a load with torque."""
    state = with_model(1.0, TASKS[0], world_of(0.45, 0))
    frames = [Observation(count * FRAME, 4.0, 1.2, 1e-3, 0.4) for count in range(1, 5001)]
    began = time.process_time()
    for frame in frames:
        state(frame)
    return 1e6 * (time.process_time() - began) / len(frames)


def draw(episodes: list[tuple[str, Episode]]) -> Figure:
    """Force over time of the first seed of each task, with the least that holds and the stick ratio below it."""
    figure = Figure(figsize=(4.2 * 4, 9.0), layout="constrained")
    grid = figure.subplots(4, 4, sharex="col", height_ratios=(3, 1, 3, 1))
    panels = [(grid[2 * (index // 4), index % 4], grid[2 * (index // 4) + 1, index % 4]) for index in range(8)]
    for (force, ratio), task in zip(panels, TASKS, strict=False):
        shown: set[str] = set()
        for name, episode in episodes:
            if episode.task is task and name not in shown:
                colour = f"C{len(shown)}"
                force.plot(episode.time, episode.normal, colour, label=name, linewidth=1.2)
                ratio.plot(episode.time, episode.stick_ratio, colour, linewidth=0.8)
                if not shown:
                    force.plot(episode.time, episode.least, "k:", label="least that holds")
                shown.add(name)
        force.set(title=task.name, ylabel="normal force, N", ylim=(0.0, None))
        ratio.set(ylabel="stick ratio", ylim=(0.0, 1.05), xlabel="time, s")
    handles, labels = panels[0][0].get_legend_handles_labels()
    panels[7][0].legend(handles, labels, frameon=False, loc="center")
    for axes in panels[7]:
        axes.axis("off")
    return figure


if __name__ == "__main__":
    main()
