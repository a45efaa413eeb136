"""What the grip controller is given, and what it answers."""

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from stiction_client.arguments import of_kind, shown
from stiction_client.elementwise import FloatArray
from stiction_client.errors import InvalidArgument
from stiction_client.planner import LARGEST

Mode = Literal["feel", "learn", "hold", "alarm"]
"""feel: friction unknown, regulated by the stick ratio; learn: the same, and the force falls until enough slips to be
sampled; hold: by a friction model; alarm: slip, evidence against the model, or nothing known."""

NUMBERS = ("time", "normal", "tangential", "torque", "stick_ratio")
"""Of an observation."""

LATEST = 1e12
"""s from 0, as of a live stream."""


@dataclass(frozen=True, slots=True, eq=False)
class SlipSamples:
    """Friction at the elements that slip in one frame: ``friction_coefficient`` [k] -, ``normal_force`` [k] N.

    ``moving``: how many of all elements that are told to slip these are, 0 to 1, the others of which are at rest.
    """

    friction_coefficient: FloatArray
    normal_force: FloatArray
    moving: float = 1.0

    def contact_friction(self) -> float:
        """What the contact's friction would be if all elements were like these: Σ μf / Σ f; NaN without samples."""
        normal = float(self.normal_force.sum())
        return float(self.friction_coefficient @ self.normal_force) / normal if normal > 0.0 else math.nan


@dataclass(frozen=True, slots=True)
class Observation:
    """One frame of one contact: ``time`` s, ``normal`` and ``tangential`` force N and ``torque`` N·m as magnitudes.

    ``stick_ratio``: NaN where the detector gives none. ``slip_samples``: None where there are none.
    """

    time: float
    normal: float
    tangential: float
    torque: float = 0.0
    stick_ratio: float = math.nan
    slip_samples: SlipSamples | None = None


@dataclass(frozen=True, slots=True)
class Command:
    """``normal_force`` N that the contact shall be pressed with, the controller's ``mode``, and the ``reason``.

    ``material``: the one among those known that the grasp was recognised for, and its ``probability``; 0 without one.
    """

    normal_force: float
    mode: Mode
    reason: str
    material: str | None = None
    probability: float = 0.0


def checked(observation: Observation, last: float) -> Observation:
    """An observation in plain floats; raises ``InvalidArgument`` for one that cannot be, or not after ``last`` s."""
    of_kind("observation", observation, Observation)
    seen = observation
    numbers = (seen.time, seen.normal, seen.tangential, seen.torque, seen.stick_ratio)
    for name, value in zip(NUMBERS, numbers, strict=True):
        if isinstance(value, bool) or not isinstance(value, float | int | np.floating | np.integer):
            raise InvalidArgument(name, shown(value), "a number")
    if not last < seen.time or not abs(seen.time) <= LATEST:
        raise InvalidArgument("time", shown(seen.time), f"later than {last:.9g} s, and within {LATEST:g} s of 0")
    for name, value in zip(NUMBERS[1:4], numbers[1:4], strict=True):
        if not 0.0 <= value <= LARGEST:
            allowed = f"a magnitude of 0 to {LARGEST:g}; without one, leave the frame out"
            raise InvalidArgument(name, shown(value), allowed)
    if not (seen.stick_ratio != seen.stick_ratio or 0.0 <= seen.stick_ratio <= 1.0):
        raise InvalidArgument("stick_ratio", shown(seen.stick_ratio), "0 to 1, or NaN where none is known")
    if seen.slip_samples is not None:
        of_kind("slip_samples", seen.slip_samples, SlipSamples)
        _check_samples(seen.slip_samples)
    if all(type(value) is float for value in numbers):
        return observation
    time, normal, tangential, torque, stick_ratio = map(float, numbers)
    return Observation(time, normal, tangential, torque, stick_ratio, seen.slip_samples)


def _check_samples(samples: SlipSamples) -> None:
    if not 0.0 <= samples.moving <= 1.0:
        raise InvalidArgument("slip_samples.moving", samples.moving, "0 to 1")
    for name in ("friction_coefficient", "normal_force"):
        values = getattr(samples, name)
        of_kind(f"slip_samples.{name}", values, np.ndarray)
        if values.shape != samples.friction_coefficient.shape or values.ndim != 1:
            raise InvalidArgument(f"slip_samples.{name}", f"of shape {list(values.shape)}", "two arrays [k]")
        numbers = values.tolist()  # a few dozen, sooner compared one by one than by NumPy
        if not all(0.0 <= number <= LARGEST for number in numbers):
            raise InvalidArgument(f"slip_samples.{name}", numbers, f"numbers of 0 to {LARGEST:g}")
