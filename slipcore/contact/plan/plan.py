"""What a scene comes to once all its effects have added their part: mechanics, loads over time, observation."""

from dataclasses import dataclass, replace
from typing import ClassVar, Literal, Protocol, Self, get_args

import numpy as np

from slipcore.contact.solver.problem import ContactProblem, StepLoad
from slipcore.errors import InvalidInput
from slipcore.frames import FloatArray, FrictionLaw, GraspLog

Channel = Literal["normal_force", "force_x", "force_y", "moment", "motion_x", "motion_y", "yaw"]
"""What a history drives: F_N N, F_x N, F_y N, M N·m on the finger, or the object's pose (m, m, rad)."""
LOADS: tuple[Channel, ...] = ("force_x", "force_y", "moment")
MOTIONS: tuple[Channel, ...] = ("motion_x", "motion_y", "yaw")


@dataclass(frozen=True, slots=True)
class History:
    """A channel over time: ``value`` at ``time`` s, linear between, constant outside. Histories of a channel add up."""

    channel: Channel
    time: tuple[float, ...]
    value: tuple[float, ...]

    def __post_init__(self) -> None:
        if self.channel not in get_args(Channel):
            raise InvalidInput("channel", self.channel, ", ".join(get_args(Channel)))
        if len(self.time) != len(self.value) or not self.time:
            raise InvalidInput(f"history of {self.channel}", f"{len(self.time)} times", f"{len(self.value)} of them")
        if not (np.isfinite(self.time).all() and np.isfinite(self.value).all()):
            raise InvalidInput(f"history of {self.channel}", "not finite", "finite times and values")
        if (np.diff(self.time) <= 0.0).any():
            raise InvalidInput(f"times of {self.channel}", list(self.time), "strictly increasing")

    def at(self, time: float) -> float:
        """Value at a time."""
        return float(np.interp(time, self.time, self.value))


def ramp(channel: Channel, value: float, start: float, duration: float) -> History:
    """From zero at ``start`` s to ``value`` within ``duration`` s, then held."""
    if not duration > 0.0:
        raise InvalidInput(f"duration of {channel}", duration, "above 0 s")
    return History(channel, (start, start + duration), (0.0, value))


@dataclass(frozen=True, slots=True)
class SamplingPlan:
    """Where and when a sensor looks: ``points`` a side at ``pitch`` m, ``frame_rate`` 1/s."""

    points: tuple[int, int]
    pitch: float
    frame_rate: float


class ObservationEffect(Protocol):
    """What a sensor makes of the truth; it never reaches the mechanics.

    ``stage`` orders observations: 1 frames, 2 drift, 3 noise. Each draws from a generator of its own.
    """

    stage: ClassVar[int]

    def observe(self, log: GraspLog, rng: np.random.Generator) -> GraspLog:
        """The log as seen through this."""


class Observed:
    """What every observation effect adds to the plan: itself."""

    __slots__ = ()

    def extend(self: ObservationEffect, plan: "Plan") -> "Plan":
        """Add an observation."""
        return replace(plan, observations=(*plan.observations, self))


@dataclass(frozen=True, slots=True)
class Plan:
    """Everything that a simulation needs, without a grid.

    ``law``: the friction law that the scene was made with; ``young_modulus`` Pa and ``poisson_ratio`` of the finger,
    for effects that depend on them; ``seed`` of random fields.
    """

    problem: ContactProblem
    duration: float
    histories: tuple[History, ...]
    law: FrictionLaw
    young_modulus: float
    poisson_ratio: float
    seed: int
    sampling: SamplingPlan | None = None
    observations: tuple[ObservationEffect, ...] = ()

    def drives(self, channel: Channel) -> bool:
        """Whether anything drives a channel."""
        return any(history.channel == channel for history in self.histories)

    def value(self, channel: Channel, time: float) -> float:
        """Sum of a channel's histories."""
        return sum(history.at(time) for history in self.histories if history.channel == channel)

    def corners(self) -> FloatArray:
        """Times s at which some history bends, within the duration."""
        times = np.unique([t for history in self.histories for t in history.time])
        return np.asarray(times[(times > 0.0) & (times < self.duration)])

    def cut_short(self) -> str:
        """Which loads and motions go on beyond the scene's end, where they are then, and what they would come to; empty
        where none does.
        """
        parts = []
        for channel in dict.fromkeys(history.channel for history in self.histories):
            own = [history for history in self.histories if history.channel == channel]
            late = sorted({time for history in own for time in history.time if time > self.duration})
            now, *later = [self.value(channel, time) for time in (self.duration, *late)]
            if any(value != now for value in later):
                parts.append(f"{channel} at {now:.3g} on its way to {later[-1]:.3g}")
        return f"after {self.duration:g} s: {', '.join(parts)}" if parts else ""

    def largest_force(self) -> float:
        """Largest normal force N."""
        return max(self.value("normal_force", float(time)) for time in (*self.corners(), self.duration))

    def load(self, before: float, now: float) -> StepLoad:
        """The load at the end of the step from ``before`` to ``now`` s."""
        moved = [self.value(channel, now) - self.value(channel, before) for channel in MOTIONS]
        return StepLoad(
            normal_force=max(self.value("normal_force", now), 0.0),
            tangential=np.array([self.value(channel, now) for channel in LOADS]),
            motion=np.array(moved),
            given=(not self.drives("motion_x"), not self.drives("motion_y"), not self.drives("yaw")),
            duration=now - before,
        )

    def check(self) -> Self:
        """Itself, after refusing a direction in which both load and motion are driven."""
        for load, motion in zip(LOADS, MOTIONS, strict=True):
            if self.drives(load) and self.drives(motion):
                raise InvalidInput(f"{load} and {motion}", "both driven", "one of them: a load or a motion")
        return self


class Effect(Protocol):
    """One physical effect of a scene: a small frozen record that adds itself to the plan.

    ``why`` and ``cost``: one sentence each, for a reader of the scene.
    """

    why: ClassVar[str]
    cost: ClassVar[str]

    @property
    def absent(self) -> bool:
        """Whether its strength is zero; it is then left out before anything is built."""

    def extend(self, plan: Plan) -> Plan:
        """The plan with this effect in it."""
