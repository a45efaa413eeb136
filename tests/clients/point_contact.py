"""A load on one contact with Coulomb friction: a plant whose every answer is known in closed form."""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import numpy as np

from stiction_client import Command, ControllerState, GraspController, Observation, SlipSamples

FRAME = 1.0 / 60.0
SUBSTEPS = 16
GRIPPER_LAG = 0.03
MASS = 0.15


@dataclass
class PointContact:
    """A mass under ``load`` (time → N) that a gripper of 30 ms lag presses; its stick ratio is Cattaneo and Mindlin's.

    ``told`` says when the detector tells anything; ``sampled_below``: stick ratio below which elements are sampled;
    ``missed``: share of the slipping area that the detector takes for sticking; ``sampled_share``: of the elements'
    friction that their samples show, less where some of them stick, each bearing what the contact bears.
    """

    load: Callable[[float], float]
    friction: float = 0.45
    told: Callable[[float], bool] = lambda _: True
    sampled_below: float = 0.9
    missed: float = 0.0
    sampled_share: float = 1.0
    seed: int = 0
    normal: float = 0.5
    velocity: float = 0.0
    slipped: float = 0.0
    generator: np.random.Generator = field(init=False)

    def __post_init__(self) -> None:
        self.generator = np.random.default_rng(self.seed)

    def advance(self, start: float, command: float) -> None:
        """Go on for a frame, pressed towards ``command`` N."""
        step = FRAME / SUBSTEPS
        for time in start + step * np.arange(SUBSTEPS):
            self.normal += (command - self.normal) * step / GRIPPER_LAG
            surplus = self.load(time) - self.friction * self.normal
            if self.velocity > 0.0 or surplus > 0.0:
                self.velocity = max(self.velocity + surplus / MASS * step, 0.0)
                self.slipped += self.velocity * step

    def observe(self, time: float) -> Observation:
        """What a sensor and a detector with errors tell: 10 mN, 0.05 of the stick ratio, 2 % of friction."""
        limit = self.friction * self.normal
        borne = limit if self.velocity > 0.0 else min(self.load(time), limit)
        ratio = (1.0 - borne / limit) ** (2.0 / 3.0)
        noise = self.generator.standard_normal(8)
        normal, tangential = np.maximum([self.normal + 0.01 * noise[0], borne + 0.01 * noise[1]], 0.0).tolist()
        if not self.told(time):
            return Observation(time, normal, tangential)
        shown = self.friction if self.sampled_share == 1.0 else self.sampled_share * borne / self.normal
        samples = SlipSamples(shown * (1.0 + 0.02 * noise[3:]), np.full(5, 0.05))
        slips = ratio < self.sampled_below
        ratio = 1.0 - (1.0 - self.missed) * (1.0 - ratio)
        return Observation(
            time, normal, tangential, 0.0, min(max(ratio + 0.05 * noise[2], 0.0), 1.0), samples if slips else None
        )


@dataclass
class Episode:
    """Commands and forces of each frame, and the plant at the end."""

    plant: PointContact
    time: list[float] = field(default_factory=list)
    normal: list[float] = field(default_factory=list)
    commands: list[Command] = field(default_factory=list)

    @property
    def least(self) -> float:
        """N that hold the last load."""
        return self.plant.load(self.time[-1]) / self.plant.friction

    def modes(self) -> list[str]:
        """Modes in the order in which they were entered."""
        modes = [command.mode for command in self.commands]
        return [mode for mode, last in zip(modes, [None, *modes], strict=False) if mode != last]


def run(
    plant: PointContact,
    state: ControllerState,
    seconds: float = 6.0,
    seen: Callable[[float], bool] = lambda _: True,
) -> Episode:
    """Close the loop; frames of which ``seen`` is False are lost, and the gripper keeps its last command."""
    episode, command = Episode(plant), plant.normal
    for time in frames(seconds):
        plant.advance(time - FRAME, command)
        if seen(time):
            state, answer = GraspController.step(state, plant.observe(time))
            command = answer.normal_force
            episode.commands.append(answer)
            episode.time.append(time)
            episode.normal.append(plant.normal)
    return episode


def frames(seconds: float) -> Iterator[float]:
    """Times of the frames, s."""
    return (count * FRAME for count in range(1, math.ceil(seconds / FRAME)))


def ramp(*loads: tuple[float, float, float]) -> Callable[[float], float]:
    """Loads (N, start s, duration s) that come on top of one another."""
    return lambda time: sum(size * min(max((time - start) / lasts, 0.0), 1.0) for size, start, lasts in loads)
