"""What the ROS 2 node computes, without ROS: stamped wrenches of a fingertip in, grip commands out."""

import math
from collections.abc import Mapping, Sequence

import numpy as np

from stiction_client import Command, Contact, ControlSettings, FrictionModel, GraspController, Observation, SlipSamples
from stiction_client.controller import gains

STALE_AFTER = 0.1
"""s after which a stick ratio, or samples, say nothing of a wrench: three frames at 30 frames/s."""

REWOUND = 1.0
"""s by which a stamp must be earlier than the last for the clock to have been set back, as a simulation's is."""


def seconds(sec: int, nanosec: int) -> float:
    """A stamp of ROS in s; double precision resolves 0.2 µs today."""
    return sec + 1e-9 * nanosec


def settings_of(parameters: Mapping[str, float]) -> ControlSettings:
    """The node's parameters as the controller takes them; raises ``InvalidArgument``.

    They are ``contact_area`` m², under ``round_at`` N of a round fingertip (0: flat), and the settings by their names.
    """
    given = {name: parameters[name] for name in gains() if name in parameters}
    area, force = parameters["contact_area"], parameters.get("round_at", 0.0)
    contact = Contact.flat(area) if force == 0.0 else Contact.round(area, force)
    return ControlSettings(contact=contact, **given)


def samples_of(told: Sequence[float]) -> SlipSamples | None:
    """Samples of slip from their message: of all elements told to slip the share that moves, 0 to 1, then of each that
    does its friction coefficient and normal force, N; 0 alone where none does. None for what cannot be.
    """
    numbers = np.asarray(told, dtype=np.float64)
    whole = numbers.size % 2 == 1 and (numbers[0] == 0.0) == (numbers.size == 1)
    if not whole or not ((numbers >= 0.0) & (numbers < math.inf)).all() or numbers[0] > 1.0:
        return None
    friction, normal = numbers[1:].reshape(-1, 2).T
    return SlipSamples(friction, normal, float(numbers[0]))


class Grip:
    """A grip controller fed with what ROS brings, in whatever order it comes."""

    def __init__(
        self,
        settings: ControlSettings,
        model: FrictionModel | None = None,
        materials: Mapping[str, FrictionModel] | None = None,
    ) -> None:
        self._settings, self._model, self._materials = settings, model, materials
        self._ratio, self._ratio_time = math.nan, -math.inf
        self._samples: SlipSamples | None = None
        self._samples_time = -math.inf
        self._begin()

    def on_stick_ratio(self, time: float, stick_ratio: float) -> None:
        """A detector's stick ratio, NaN where it gives none; one that comes late is left out."""
        if time >= self._ratio_time or self._ratio_time - time > REWOUND:
            self._ratio, self._ratio_time = stick_ratio, time

    def on_slip_samples(self, time: float, told: Sequence[float]) -> None:
        """What ``samples_of`` reads; a wrench takes the latest, each once, and those that come late are left out."""
        if time >= self._samples_time or self._samples_time - time > REWOUND:
            self._samples, self._samples_time = samples_of(told), time

    def on_wrench(
        self, time: float, force: tuple[float, float, float], torque: tuple[float, float, float]
    ) -> Command | None:
        """The command after a wrench on the finger (N, N·m; z along the outward normal of the sensor's surface).

        None for a wrench that is no later than the last, or that is not finite. A clock set back begins a new grasp.
        """
        if self._time - time > REWOUND:
            self._begin()
        if not time > self._time or not all(map(math.isfinite, (*force, *torque))):
            return None
        self._time = time
        self._state, command = GraspController.step(self._state, self._observation(time, force, torque))
        return command

    def _begin(self) -> None:
        self._time, self._state = -math.inf, GraspController.init(self._settings, self._model, self._materials)

    def _observation(
        self, time: float, force: tuple[float, float, float], torque: tuple[float, float, float]
    ) -> Observation:
        ratio = self._ratio if abs(time - self._ratio_time) <= STALE_AFTER else math.nan
        samples = self._samples if abs(time - self._samples_time) <= STALE_AFTER else None
        self._samples = None  # one frame's elements are no new evidence with each wrench
        tangential = math.hypot(force[0], force[1])
        return Observation(time, max(-force[2], 0.0), tangential, abs(torque[2]), ratio, samples)
