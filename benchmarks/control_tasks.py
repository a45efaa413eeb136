"""Tasks of grip control in the reduced world: what loads one finger, and an episode of a strategy with one of them.

A grasp of two fingers that face each other is alike on both, so that one finger with its share of mass and load stands
for it. The object stands on a table at first, which lets go of it within 1 s.
"""

import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from scipy.ndimage import gaussian_filter

from slipcore import SlipDetector, SlipState
from slipcore.contact import reduced
from slipcore.contact.effects import SensorSampling
from slipcore.contact.reduced import GRAVITY, Load, World, WorldState
from slipcore.element_forces import element_forces
from slipcore.frames import FloatArray, Frame
from stiction_client import Contact, Observation, SlipSamples

FRAME = 1.0 / 60.0
LIFT, LIFTED = 0.5, 1.5
"""s at which the table begins to let go, and has let go."""

POINTS, PITCH = (20, 20), 0.75e-3
MARKER_NOISE, FORCE_NOISE = 1e-6, 2e-3
"""m, N: of sensors that are sold (docs/detector.md)."""

SCATTER, LENGTH = 0.05, 2e-3
"""Of friction over the contact: relative standard deviation, and correlation length, m."""
BETWEEN = 0.02
"""Standard deviation of friction from grasp to grasp."""

WINDOW = 6
"""Frames over which an element's slip is averaged: noise of 1 µm then makes 14 µm/s."""
LEAST_SPEED = 5e-5
"""m/s of an element whose friction is sampled: above 3 standard deviations of that."""
LEAST_SHARE = 0.1
"""Of the largest normal force in the frame: at the rim forces are least certain."""

START = 1.0
"""N with which the finger touches at first."""


@dataclass(frozen=True)
class Task:
    """``load`` on one finger over time (s), for ``seconds``; mean ``friction`` of the material."""

    name: str
    friction: float
    seconds: float
    load: Callable[[float], Load]


class Strategy(Protocol):
    """Whatever commands a normal force, N, frame by frame."""

    def __call__(self, seen: Observation) -> float:
        """The command after a frame."""


@dataclass
class Episode:
    """Arrays over the frames: ``time`` s, ``normal`` force, its ``command`` and the ``least`` that would hold (N), true
    and told ``stick_ratio`` and ``told``; ``slipped`` m.
    """

    task: Task
    time: list[float] = field(default_factory=list)
    normal: list[float] = field(default_factory=list)
    command: list[float] = field(default_factory=list)
    least: list[float] = field(default_factory=list)
    stick_ratio: list[float] = field(default_factory=list)
    told: list[float] = field(default_factory=list)
    slipped: list[float] = field(default_factory=list)


def world_of(friction: float, seed: int) -> World:
    """A finger on the material: its friction differs from grasp to grasp, and over the contact."""
    generator = np.random.default_rng(seed)
    mean = friction + BETWEEN * generator.standard_normal()
    field_ = gaussian_filter(generator.standard_normal(POINTS), LENGTH / PITCH, mode="wrap")
    scatter = SCATTER * (field_ - field_.mean()) / field_.std()
    sampling = SensorSampling(POINTS, PITCH, 1.0 / FRAME)
    return World(
        friction=(mean * (1.0 + scatter))[None],
        sampling=sampling,
        marker_noise=MARKER_NOISE,
        force_noise=FORCE_NOISE,
    )


def contact_of(world: World) -> Contact:
    """The finger as the controller is told of it."""
    return Contact.round(math.pi * world.contact(5.0).contact_radius ** 2, at_force=5.0)


def run(task: Task, world: World, strategy: Strategy, seed: int) -> Episode:
    """One episode; ends when the object is lost (10 mm) or the task is over."""
    generator = np.random.default_rng([seed, 1])
    detector = SlipDetector(world.position, world.element_area)
    state, command, episode = reduced.init(world, START), START, Episode(task)
    sampler = Sampler()
    for count in range(1, round(task.seconds / FRAME) + 1):
        load = task.load(count * FRAME)
        state = reduced.step(world, state, command, load, FRAME)
        seen = reduced.observe(world, state, generator=generator)
        found = detector.step(seen.time, seen.displacement, seen.force)
        command = strategy(observation(world, seen, found, sampler))
        _keep(episode, world, state, load, command, found)
        if state.slipped[0] > 10e-3:
            break
    return episode


class Sampler:
    """Friction where elements slip: well pressed, slipping for ``WINDOW`` frames, and fast enough to be seen."""

    def __init__(self) -> None:
        self.last: deque[SlipState] = deque(maxlen=WINDOW)

    def __call__(self, force: FloatArray, found: SlipState) -> SlipSamples | None:
        """The samples of a frame, if there are any."""
        self.last.append(found)
        forces = element_forces(force, np.broadcast_to([0.0, 0.0, 1.0], force.shape))
        velocity = np.nan_to_num(np.mean([state.velocity for state in self.last], axis=0))
        slips = np.all([state.slip for state in self.last], axis=0) & (len(self.last) == WINDOW)
        pressed = forces.pressing > LEAST_SHARE * forces.pressing.max()
        use = slips & pressed & (np.hypot(velocity[..., 0], velocity[..., 1]) > LEAST_SPEED)
        return SlipSamples(forces.tangential[use] / forces.pressing[use], forces.pressing[use]) if use.any() else None


def observation(world: World, seen: Frame, found: SlipState, sampler: Sampler) -> Observation:
    """A frame as a controller takes it: resultants of the elements' forces, and what the detector says."""
    assert seen.force is not None
    total = seen.force[found.contact].sum(axis=0)
    x, y = world.position[..., 0], world.position[..., 1]
    torque = float((x * seen.force[..., 1] - y * seen.force[..., 0])[found.contact].sum())
    return Observation(
        seen.time,
        max(-float(total[2]), 0.0),
        float(np.hypot(total[0], total[1])),
        abs(torque),
        found.stick_ratio,
        sampler(seen.force, found),
    )


def _keep(episode: Episode, world: World, state: WorldState, load: Load, command: float, found: SlipState) -> None:
    episode.time.append(state.time)
    episode.normal.append(float(state.normal_force[0]))
    episode.command.append(command)
    episode.least.append(least_force(world, load, contact_of(world)))
    episode.stick_ratio.append(reduced.stick_ratio(world, state))
    episode.told.append(found.stick_ratio)
    episode.slipped.append(float(state.slipped[0]))


def least_force(world: World, load: Load, contact: Contact) -> float:
    """Normal force, N, at which the contact could just bear the load at rest (elliptic limit surface)."""
    x, y, moment = load.resultant()
    radius = np.hypot(world.position[..., 0], world.position[..., 1])
    force = START
    for _ in range(30):
        height = np.sqrt(np.maximum(1.0 - (radius / world.contact(force).contact_radius) ** 2, 0.0))
        friction = float((world.friction[0] * height).sum() / height.sum())
        force = max(math.hypot(x, y, moment / float(contact.arm(force))) / friction, 0.05)
    return force


def rise(time: float, start: float, lasts: float) -> float:
    """0 before ``start``, 1 after ``start + lasts``, evenly between, s."""
    return min(max((time - start) / lasts, 0.0), 1.0)


def on_table(time: float) -> float:
    """Share of the weight that the table still bears."""
    return 1.0 - rise(time, LIFT, LIFTED - LIFT)


def lift(mass: float, friction: float) -> Task:
    """Lift ``mass`` kg a finger and hold it."""
    return Task(f"lift, {mass * GRAVITY:.1f} N, μ {friction:g}", friction, 6.0, lambda t: Load(mass, on_table(t)))


def cup() -> Task:
    """Fig. 19(c): water runs into a cup that is held."""
    return Task("cup being filled", 0.45, 7.0, lambda t: Load(0.05 + 0.15 * rise(t, 2.0, 3.0), on_table(t)))


def sudden() -> Task:
    """Fig. 19(a): a load and a twist come onto a held object within 150 ms, and go again after a second."""

    def load(time: float) -> Load:
        share = rise(time, 4.0, 0.15) - rise(time, 5.0, 0.15)
        return Load(0.1, on_table(time), (0.8 * share, 0.0), 1e-3 * share)

    return Task("sudden load and twist", 0.45, 7.0, load)


def block() -> Task:
    """Fig. 19(e): a block is pulled out, and its friction against the one below grows within 150 ms."""

    def load(time: float) -> Load:
        pull = 0.4 * rise(time, 2.0, 0.3) + 0.8 * rise(time, 4.0, 0.15)
        return Load(0.05, on_table(time), (pull, 0.0))

    return Task("block, friction jumps", 0.45, 7.0, load)


TASKS = (lift(0.05, 0.45), lift(0.15, 0.45), lift(0.1, 0.3), lift(0.1, 0.7), cup(), sudden(), block())
