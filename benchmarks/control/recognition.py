"""What a grasp can show of its material within a second: `python -m benchmarks.control.recognition [--seeds 5]`.

Twelve lifts by the controller that is told of three materials (benchmarks/control/strategies.py, ``one of three``). Per
friction: in how many the right one was named within a second of the load's begin, and ever, and another; and in how
many an ideal observer could have: one that sees from the true forces which elements slip, without noise or delay.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from benchmarks.control.episodes import Task, run, world_of
from benchmarks.control.strategies import LIFTED, Controlled, among_three
from benchmarks.control.tasks import LIFT, LIFTS
from benchmarks.pages import options, table, write
from slipcore.contact import reduced
from slipcore.contact.reduced import Load, World, WorldState
from slipcore.frames import FloatArray, Frame
from stiction_client import GraspController, Observation

SECOND = 1.0
"""s after the load began."""
PRESSED = 0.1
"""Of the largest normal force: what presses less is not sampled, as for the controller (service.stream.observing)."""
LIMIT = 0.9999
"""Of its friction, from which on an element slips: without noise, to rounding."""
SEEN_FRAMES = 10
"""Frames in which an element must slip to be sampled and counted: the observer's six, and the controller's five, of
which one is the observer's last (``recognise_frames``)."""

HEADINGS = {
    "friction": "μ",
    "named": "named within 1 s",
    "ever": "ever",
    "wrong": "another named",
    "slips": "any element slips within 1 s",
    "lasts": "for 10 frames",
    "used": "load over what it could bear, at most",
    "held": "held",
}


@dataclass
class TruePhysics:
    """The reduced world that notes, in each frame, how many well pressed elements slip, and when (s)."""

    time: list[float] = field(default_factory=list)
    slipping: list[int] = field(default_factory=list)

    def init(self, world: World, normal_force: float) -> WorldState:
        """As the world's."""
        return reduced.init(world, normal_force)

    def step(self, world: World, state: WorldState, command: FloatArray, load: Load, duration: float) -> WorldState:
        """As the world's."""
        return reduced.step(world, state, command, load, duration)

    def observe(self, world: World, state: WorldState, finger: int, generator: np.random.Generator) -> Frame:
        """As the world's; what slips is taken from the frame without noise."""
        force = reduced.observe(world, state, finger).force
        assert force is not None
        normal, shear = -force[..., 2], np.hypot(force[..., 0], force[..., 1])
        slips = (normal > PRESSED * normal.max()) & (shear >= LIMIT * world.friction[finger] * normal)
        self.time.append(state.time)
        self.slipping.append(int(slips.sum()))
        return reduced.observe(world, state, finger, generator)

    def stick_ratio(self, world: World, state: WorldState, finger: int) -> float:
        """As the world's."""
        return reduced.stick_ratio(world, state, finger)


class Grasp(NamedTuple):
    """One lift: which material was ``named``, and when after the load began (s; infinite: never); in how many
    ``frames`` of the first second an element slipped; and the largest load over what the contact could bear in it.
    """

    friction: float
    named: str | None
    after: float
    frames: int
    used: float
    held: bool


@dataclass
class Naming:
    """A strategy of the controller that notes when it named a material."""

    controlled: Controlled
    named: str | None = None
    time: float = np.inf

    def __call__(self, seen: Observation) -> float:
        """Its command."""
        self.controlled.state, command = GraspController.step(self.controlled.state, seen)
        if self.named is None and command.material is not None:
            self.named, self.time = command.material, seen.time
        return command.normal_force


def main() -> None:
    """Lift, count and write."""
    parser = options(__doc__)
    parser.add_argument("--seeds", type=int, default=5, help="of each lift")
    arguments = parser.parse_args()
    grasps = [grasp(task, seed) for seed in range(arguments.seeds) for task in LIFTS]
    rows = [counted(friction, [each for each in grasps if each.friction == friction]) for friction in LIFTED]
    text = table(list(HEADINGS.values()), [[row[key] for key in HEADINGS] for row in rows])
    print(text)
    write(
        {"seeds": arguments.seeds, "rows": rows}, {"control recognition": text}, arguments, "control_recognition.json"
    )


def grasp(task: Task, seed: int) -> Grasp:
    """One lift from one seed, whose load begins at ``LIFT``."""
    world, physics = world_of(task, seed), TruePhysics()
    made: Any = among_three(task, world, 0)
    strategy = Naming(made)
    done = run(task, world, [strategy], seed, physics=physics)
    first = (done.time > LIFT) & (done.time <= LIFT + SECOND)
    frames = int(np.count_nonzero(np.array(physics.slipping)[: done.time.size][first]))
    used = float((done.least[first, 0] / done.normal[first, 0]).max())
    return Grasp(
        task.friction[0], strategy.named, strategy.time - LIFT, frames, used, held=bool(done.slipped[-1].max() < 3e-3)
    )


def counted(friction: float, grasps: Sequence[Grasp]) -> dict[str, object]:
    """A row of the table."""
    right = [each for each in grasps if each.named == f"{friction:g}"]
    total = len(grasps)
    return {
        "friction": friction,
        "named": f"{sum(each.after <= SECOND for each in right)}/{total}",
        "ever": f"{len(right)}/{total}",
        "wrong": f"{sum(each.named not in (None, f'{friction:g}') for each in grasps)}/{total}",
        "slips": f"{sum(each.frames > 0 for each in grasps)}/{total}",
        "lasts": f"{sum(each.frames >= SEEN_FRAMES for each in grasps)}/{total}",
        "used": round(float(np.median([each.used for each in grasps])), 2),
        "held": f"{sum(each.held for each in grasps)}/{total}",
    }


if __name__ == "__main__":
    main()
