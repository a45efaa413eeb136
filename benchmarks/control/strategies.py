"""Strategies of grip control: the controller with a model, right or wrong, and without; what it is compared with."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np

from benchmarks.control.episodes import BETWEEN, FRAME, START, Strategy, Task, contact_of
from slipcore.contact import reduced
from slipcore.contact.reduced import World
from stiction_client import ControllerState, ControlSettings, Cost, Domain, FrictionModel, GraspController, Observation
from stiction_client.controller.load import LoadEstimate
from stiction_client.controller.stick_ratio import StickRatioEstimate

MOST = 30.0
"""N of the gripper."""

BENEATH = 0.04
"""Relative standard deviation of friction under one contact, of 1 to 3 N, by its field alone (400 other seeds): the
field's spots are as large as half of the contact, which does not average them out.
"""

LIFTED = (0.3, 0.45, 0.7)
"""Friction of the materials among which the object's is recognised."""
OFTEN, LIGHT = 1e-2, 0.5
"""Slip in one of a hundred loads; N of the least force, below that of the first touch: light loads need less."""

FIXED = 0.2
"""Friction of the fixed strategy."""

REGULATED = 0.7
"""Stick ratio that is regulated where nothing else is."""
REFLEX_STEP, REFLEX_STICK_RATIO = 0.5, 0.5
"""N by which the slip reflex presses harder in each frame in which no more than that of the contact sticks."""

EXPLORED_WITH, EXPLORED_MASS, EXPLORED_SLIP = 2.0, 2.0, 1e-3
"""N of the exploration; kg that it moves, so that sliding is slow; m after which it ends."""
EXPLORED_MARGIN = 0.09
"""Of the friction that was explored: three of the controller's own standard deviations of what is learnt."""


@dataclass
class Controlled:
    """A ``GraspController`` and its state."""

    state: ControllerState

    def __call__(self, seen: Observation) -> float:
        """Its command."""
        self.state, command = GraspController.step(self.state, seen)
        return command.normal_force


@dataclass
class UnderLoad:
    """As hard as the load to come asks for, with the controller's lead; it falls by ``fall_rate``, 1/s, at most."""

    settings: ControlSettings
    fall_rate: float
    load: LoadEstimate = field(default_factory=LoadEstimate)
    time: float = 0.0
    force: float = START

    def __call__(self, seen: Observation) -> float:
        """Its command."""
        elapsed, self.time = seen.time - self.time, seen.time
        self.load = self.load.step(seen, elapsed, self.settings)
        slowest = self.force * (1.0 - self.fall_rate * elapsed)
        self.force = min(max(self.asked(seen), slowest, START), MOST)
        return self.force

    def asked(self, seen: Observation) -> float:
        """Force, N, that the load asks for after a frame."""
        raise NotImplementedError


class Fixed(UnderLoad):
    """By one ``friction``, with the controller's rates."""

    def __init__(self, settings: ControlSettings, friction: float = FIXED) -> None:
        super().__init__(settings, settings.fall_rate)
        self.friction = friction

    def asked(self, seen: Observation) -> float:  # noqa: ARG002 - the load is all that it heeds
        """By that friction."""
        return self.load.lead(self.settings) / self.friction


class ByStickRatio(UnderLoad):
    """So that ``REGULATED`` of the contact sticks, by what the stick ratio shows of friction; nothing is learnt."""

    def __init__(self, settings: ControlSettings) -> None:
        super().__init__(settings, settings.relax_rate)
        self.sticking = StickRatioEstimate()

    def asked(self, seen: Observation) -> float:
        """By the friction that was shown last; nothing before any."""
        self.sticking = self.sticking.step(seen, self.load, self.settings)
        return self.sticking.required(self.load.lead(self.settings), REGULATED)


@dataclass
class Reflex:
    """Harder by a step in each frame in which the detector sees most of the contact slip; it never lets go again."""

    force: float = START

    def __call__(self, seen: Observation) -> float:
        """Its command."""
        if seen.stick_ratio <= REFLEX_STICK_RATIO:
            self.force = min(self.force + REFLEX_STEP, MOST)
        return self.force


@dataclass(frozen=True)
class Approach:
    """``make`` a strategy for one finger of a task in a world; ``missed``: slip that the detector does not tell."""

    make: Callable[[Task, World, int], Strategy]
    missed: float = 0.0


def settings_of(world: World, most: float = MOST, **changed: float) -> ControlSettings:
    """The controller's defaults for this finger."""
    given: dict[str, Any] = {"least_force": LIGHT, "touch_force": START, "most_force": min(most, MOST)} | changed
    return ControlSettings(contact=contact_of(world), **given)


def model_of(friction: float, world: World) -> FrictionModel:
    """A model that knows the material's mean and how much contacts differ: from grasp to grasp, and by their field."""
    return FrictionModel(
        material="material",
        method="hierarchical",
        version=1,
        coefficients=np.array([friction, 0.0, 0.0]),
        covariance=np.zeros((3, 3)),
        scale=math.hypot(BETWEEN, BENEATH * friction),
        n=10_000,
        degrees_of_freedom=np.inf,
        scatter_degrees_of_freedom=np.inf,
        domain=Domain((0.0, 0.01), (0.0, 1.0)),
        identifiable=np.ones(3, bool),
        element_area=world.element_area,
        cost=Cost(0.0),
    )


def with_model(factor: float, task: Task, world: World, finger: int, **changed: float) -> Strategy:
    """The controller with the material's friction, or ``factor`` times it; it is told what breaks the object."""
    model = model_of(factor * (task.told or task.friction)[finger], world)
    return Controlled(GraspController.init(settings_of(world, task.limit, **changed), model))


def among_three(task: Task, world: World, finger: int) -> Strategy:  # noqa: ARG001
    """The controller that is told of three materials, of which the object's is one, but for the block's rough face."""
    materials = {f"{friction:g}": model_of(friction, world) for friction in LIFTED}
    return Controlled(GraspController.init(settings_of(world, task.limit), materials=materials))


def without_model(task: Task, world: World, finger: int) -> Strategy:  # noqa: ARG001 - all strategies are made alike
    """The controller on an unknown material; it is told what breaks the object."""
    return Controlled(GraspController.init(settings_of(world, task.limit)))


def by_stick_ratio(task: Task, world: World, finger: int) -> Strategy:  # noqa: ARG001
    """The stick ratio alone."""
    return ByStickRatio(settings_of(world))


def fixed(task: Task, world: World, finger: int) -> Strategy:  # noqa: ARG001
    """One low friction for all materials."""
    return Fixed(settings_of(world))


def reflex(task: Task, world: World, finger: int) -> Strategy:  # noqa: ARG001
    """A step harder when slip is seen."""
    return Reflex()


def explored(task: Task, world: World, finger: int) -> Strategy:  # noqa: ARG001
    """The friction of a separate exploration before the task."""
    return Fixed(settings_of(world), (1.0 - EXPLORED_MARGIN) * exploration(world, finger)[0])


def exploration(world: World, finger: int) -> tuple[float, float]:
    """Friction by sliding on purpose, and the time, s, that it takes.

    The finger presses lightly and is moved along the object until it has slid; the mean of tangential over normal force
    while it slides, as its force sensor measures both.
    """
    alone = replace(world, friction=world.friction[finger : finger + 1])
    generator = np.random.default_rng(finger)
    state, ratios = reduced.init(alone, EXPLORED_WITH), []
    while state.slipped[0] < EXPLORED_SLIP:
        pull = reduced.Load(EXPLORED_MASS, 1.0, (EXPLORED_WITH * state.time, 0.0))
        state = reduced.step(alone, state, EXPLORED_WITH, pull, FRAME)
        force = reduced.observe(alone, state, generator=generator).force
        if force is not None and state.slipped[0] > 0.0:
            total = force.sum(axis=(0, 1))
            ratios.append(float(np.hypot(*total[:2]) / -total[2]))
    return float(np.mean(ratios)), state.time


CONTROLLERS = {
    "known": Approach(partial(with_model, 1.0)),
    "unknown": Approach(without_model),
    "known, 1 in 100 may slip": Approach(partial(with_model, 1.0, slip_probability=OFTEN)),
    "one of three": Approach(among_three),
}
MISLED = {
    "known, half of slip missed": Approach(partial(with_model, 1.0), missed=0.5),
    "unknown, half of slip missed": Approach(without_model, missed=0.5),
    "model 40 % too high": Approach(partial(with_model, 1.4)),
    "model 40 % too low": Approach(partial(with_model, 0.6)),
}
BASELINES = {
    f"fixed μ = {FIXED:g}": Approach(fixed),
    "stick ratio alone": Approach(by_stick_ratio),
    "slip reflex": Approach(reflex),
    "explored before": Approach(explored),
}
STRATEGIES = CONTROLLERS | MISLED | BASELINES
