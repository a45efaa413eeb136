"""An episode of grip control in the reduced world: a task, a strategy for each finger, and the real detector.

A grasp of two fingers that face each other is alike on both, so that one finger with its share of mass and load stands
for it, except where the task says that the two contacts differ.
"""

import dataclasses
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Protocol

import numpy as np
from scipy.ndimage import gaussian_filter

from service.stream.observing import Observer
from slipcore import SlipDetector
from slipcore.contact import reduced
from slipcore.contact.effects import SensorSampling
from slipcore.contact.reduced import Load, World
from slipcore.frames import BoolArray, FloatArray, Frame
from slipcore.slip_state import stick_ratio
from stiction_client import Contact, Observation

FRAME = 1.0 / 60.0

POINTS, PITCH = (20, 20), 0.75e-3
MARKER_NOISE, FORCE_NOISE = 1e-6, 2e-3
"""m, N: of sensors that are sold (docs/detector.md)."""

SCATTER, LENGTH = 0.05, 2e-3
"""Of friction over the contact: relative standard deviation, and correlation length, m."""
BETWEEN = 0.02
"""Standard deviation of friction from grasp to grasp."""

START = 1.0
"""N with which the finger touches at first."""

LOST = 10e-3
"""m of slip after which an episode ends."""

OPENING, FALLING = 0.5, 3.0
"""s in which a gripper opens, and after which an object that is still there is stuck (SimReady FET005)."""


@dataclass(frozen=True)
class Task:
    """``load`` on all fingers over time (s), for ``seconds``; mean ``friction`` of the material at each finger, and
    what models are ``told`` that it is, where that differs; ``limit``: normal force, N, above which the object breaks;
    ``opens``: whether the gripper opens at the end.
    """

    name: str
    friction: tuple[float, ...]
    seconds: float
    load: Callable[[float], Load]
    limit: float = math.inf
    told: tuple[float, ...] = ()
    opens: bool = False


class Strategy(Protocol):
    """Whatever commands a normal force, N, frame by frame."""

    def __call__(self, seen: Observation) -> float:
        """The command after a frame."""


class Physics(Protocol):
    """What moves a world on and sees it, as ``slipcore.contact.reduced`` does; its states have ``time``,
    ``normal_force`` and ``slipped``.
    """

    def init(self, world: World, normal_force: float) -> Any:
        """Fingers at rest."""

    def step(self, world: World, state: Any, command: FloatArray, load: Load, duration: float) -> Any:
        """The world after a while."""

    def observe(self, world: World, state: Any, finger: int, generator: np.random.Generator) -> Frame:
        """What the sensor of one finger sees."""

    def stick_ratio(self, world: World, state: Any, finger: int) -> float:
        """The true one."""


@dataclass(frozen=True, eq=False)
class Episode:
    """Arrays over the frames: ``time`` s; and [frames, fingers] of ``normal`` force, its ``command`` and the ``least``
    that would hold (N), true and ``told`` ``stick_ratio``, and ``slipped`` m. ``freed``: whether the object left a
    gripper that opened; True where none did.
    """

    task: str
    limit: float
    time: FloatArray
    normal: FloatArray
    command: FloatArray
    least: FloatArray
    stick_ratio: FloatArray
    told: FloatArray
    slipped: FloatArray
    freed: bool = True


def world_of(task: Task, seed: int) -> World:
    """Fingers on the material: its friction differs from grasp to grasp, and over each contact."""
    generator = np.random.default_rng(seed)
    sampling = SensorSampling(POINTS, PITCH, 1.0 / FRAME)
    fields = [_field(friction, generator) for friction in task.friction]
    return World(friction=np.stack(fields), sampling=sampling, marker_noise=MARKER_NOISE, force_noise=FORCE_NOISE)


def _field(friction: float, generator: np.random.Generator) -> FloatArray:
    mean = friction + BETWEEN * generator.standard_normal()
    field = gaussian_filter(generator.standard_normal(POINTS), LENGTH / PITCH, mode="wrap")
    return np.asarray(mean * (1.0 + SCATTER * (field - field.mean()) / field.std()))


def contact_of(world: World) -> Contact:
    """The finger as the controller is told of it."""
    return Contact.round(math.pi * world.contact(5.0).contact_radius ** 2, at_force=5.0)


def run(
    task: Task,
    world: World,
    strategies: Sequence[Strategy],
    seed: int,
    missed: float = 0.0,
    physics: Physics = reduced,  # type: ignore[assignment]
) -> Episode:
    """One episode with a strategy for each finger; ends when the object is lost or the task is over.

    ``missed``: share of the elements whose slip the detector never tells.
    """
    generator = np.random.default_rng([seed, 1])
    sensors = [_Sensor(world, finger, generator, missed) for finger in range(len(strategies))]
    state, commands, rows = physics.init(world, START), np.full(len(strategies), START), []
    for count in range(1, round(task.seconds / FRAME) + 1):
        load = task.load(count * FRAME)
        state = physics.step(world, state, commands, load, FRAME)
        frames = [physics.observe(world, state, sensor.finger, generator) for sensor in sensors]
        seen = [sensor(frame) for sensor, frame in zip(sensors, frames, strict=True)]
        commands = np.array([strategy(each) for strategy, each in zip(strategies, seen, strict=True)])
        sticks = [physics.stick_ratio(world, state, sensor.finger) for sensor in sensors]
        rows.append(_row(world, state, load, commands, sticks, seen))
        if state.slipped.max() > LOST:
            break
    time, *columns = (np.array(column) for column in zip(*rows, strict=True))
    freed = not task.opens or _freed(world, state, task.load(task.seconds), physics)
    return Episode(task.name, task.limit, time, *columns, freed)


def _freed(world: World, state: Any, load: Load, physics: Physics) -> bool:
    """Whether the object leaves the gripper that opens; where it is apart, how far it slipped is NaN."""
    held = state.normal_force
    for count in range(round((OPENING + FALLING) / FRAME)):
        opening = max(1.0 - count * FRAME / OPENING, 0.0)
        state = physics.step(world, state, opening * held, load, FRAME)
        if not (state.slipped <= LOST).all():
            return True
    return False


def _row(
    world: World, state: Any, load: Load, commands: FloatArray, sticks: list[float], seen: list[Observation]
) -> tuple[object, ...]:
    least = [least_force(world, load, finger) for finger in range(len(commands))]
    told = [each.stick_ratio for each in seen]
    return state.time, state.normal_force, commands, least, sticks, told, state.slipped


class _Sensor:
    """One finger's sensor with its detector."""

    def __init__(self, world: World, finger: int, generator: np.random.Generator, missed: float) -> None:
        self.finger = finger
        self.detector = SlipDetector(world.position, world.element_area)
        self.seen: BoolArray = generator.random(POINTS) >= missed
        self.observer = Observer(world.position)

    def __call__(self, frame: Frame) -> Observation:
        """A frame as a controller takes it."""
        found = self.detector.step(frame.time, frame.displacement, frame.force, normal=frame.normal)
        slip = found.slip & self.seen
        told = dataclasses.replace(found, slip=slip, stick_ratio=stick_ratio(found.contact, slip))
        self.observer, seen = self.observer.step(frame, told)
        return seen


@lru_cache(maxsize=2048)
def least_force(world: World, load: Load, finger: int = 0) -> float:
    """Normal force, N, at which a finger could just bear its share of the load at rest (elliptic limit surface)."""
    x, y, moment = (part / len(world.friction) for part in load.resultant())
    contact, friction = contact_of(world), world.friction[finger]
    radius = np.hypot(world.position[..., 0], world.position[..., 1])
    force, before = START, math.inf
    for _ in range(30):
        if abs(force - before) < 1e-9 * force:
            break
        height = np.sqrt(np.maximum(1.0 - (radius / world.contact(force).contact_radius) ** 2, 0.0))
        mean = float((friction * height).sum() / height.sum())
        force, before = max(math.hypot(x, y, moment / float(contact.arm(force))) / mean, 0.05), force
    return force
