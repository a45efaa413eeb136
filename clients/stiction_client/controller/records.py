"""What the grip controller is given, and what it answers."""

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from stiction_client.arguments import of_kind, shown
from stiction_client.elementwise import FloatArray
from stiction_client.errors import InvalidArgument

Mode = Literal["feel", "learn", "hold", "alarm"]
"""feel: friction unknown, regulated by the stick ratio; learn: the same, and the force falls until enough slips to be
sampled; hold: by a friction model; alarm: slip, evidence against the model, or nothing known."""


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


def check(observation: Observation, last: float) -> None:
    """Refuse an observation that cannot be, or is no later than ``last`` s; raises ``InvalidArgument``."""
    of_kind("observation", observation, Observation)
    for name in ("time", "normal", "tangential", "torque", "stick_ratio"):
        value = getattr(observation, name)
        if isinstance(value, bool) or not isinstance(value, float | int | np.floating | np.integer):
            raise InvalidArgument(name, shown(value), "a number")
    if not last < observation.time < math.inf:
        raise InvalidArgument("time", observation.time, f"finite, later than {last:.9g} s")
    for name in ("normal", "tangential", "torque"):
        value = getattr(observation, name)
        if not 0.0 <= value < math.inf:
            raise InvalidArgument(name, value, "a finite magnitude of 0 or more; without one, leave the frame out")
    if not (math.isnan(observation.stick_ratio) or 0.0 <= observation.stick_ratio <= 1.0):
        raise InvalidArgument("stick_ratio", observation.stick_ratio, "0 to 1, or NaN where none is known")
    if observation.slip_samples is not None:
        of_kind("slip_samples", observation.slip_samples, SlipSamples)
        _check_samples(observation.slip_samples)


def _check_samples(samples: SlipSamples) -> None:
    if not 0.0 <= samples.moving <= 1.0:
        raise InvalidArgument("slip_samples.moving", samples.moving, "0 to 1")
    for name in ("friction_coefficient", "normal_force"):
        values = getattr(samples, name)
        of_kind(f"slip_samples.{name}", values, np.ndarray)
        if values.shape != samples.friction_coefficient.shape or values.ndim != 1:
            raise InvalidArgument(f"slip_samples.{name}", f"of shape {list(values.shape)}", "two arrays [k]")
        numbers = values.tolist()  # a few dozen, sooner compared one by one than by NumPy
        if not all(0.0 <= number < math.inf for number in numbers):
            raise InvalidArgument(f"slip_samples.{name}", numbers, "finite numbers of 0 or more")
