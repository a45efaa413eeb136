"""The load on a contact, its rate, and what it will be when the gripper has followed."""

import math
from dataclasses import dataclass

from stiction_client.controller.records import Observation
from stiction_client.controller.settings import ControlSettings
from stiction_client.defaults import LOAD_NOISE, NOISE_FRAMES
from stiction_client.errors import InvalidArgument


@dataclass(frozen=True, slots=True)
class LoadEstimate:
    """``size`` N of tangential force and torque together, how fast it grows, and since when it is ``steady`` (s).

    ``rate`` N/s: found soon, and noisy; ``trend`` N/s: the same, found later and more exactly; ``noise`` N: a standard
    deviation of one frame's ``size``, by what changes beside the trend.
    """

    size: float = 0.0
    rate: float = 0.0
    trend: float = 0.0
    steady: float = math.inf
    noise: float = LOAD_NOISE

    def step(self, observation: Observation, elapsed: float, settings: ControlSettings) -> "LoadEstimate":
        """The load after a frame; over a gap its rate is not known, and taken as 0."""
        size = size_of(observation, settings)
        if not elapsed <= settings.dropout_time:
            return LoadEstimate(size, steady=observation.time, noise=self.noise)
        rate = _followed(self.rate, size - self.size, elapsed, settings.rate_time)
        trend = _followed(self.trend, size - self.size, elapsed, settings.trend_time)
        noise = _scatter(self.noise, size - self.size - trend * elapsed)
        surely = rate - noise / (elapsed + settings.rate_time)
        changes = settings.lead_time * _beyond(surely, trend, settings) > settings.steady_share * size or size == 0.0
        return LoadEstimate(size, rate, trend, math.inf if changes else min(self.steady, observation.time), noise)

    def loads(self, settings: ControlSettings) -> bool:
        """Whether it needs more than the least force, were friction low."""
        return self.size > settings.unknown_friction * settings.least_force

    def settled(self, time: float, settings: ControlSettings) -> bool:
        """Whether a load that needs more than the least force has been steady for a while, at ``time`` s."""
        return self.loads(settings) and time - self.steady >= settings.settle_time

    def lead(self, settings: ControlSettings) -> float:
        """Size in ``lead_time``, N, if it grows; else as it is."""
        return self.after(settings.lead_time, settings)

    def after(self, time: float, settings: ControlSettings) -> float:
        """Size in ``time`` s, N, if it goes on growing as it does; else as it is."""
        return self.size + _beyond(self.rate, self.trend, settings) * time

    def growth(self, settings: ControlSettings) -> float:
        """Factor by which the load will have grown in ``lead_time``."""
        return self.lead(settings) / self.size if self.size > 0.0 else 1.0


def _beyond(rate: float, trend: float, settings: ControlSettings) -> float:
    """How fast a load grows, N/s, beyond what noise makes of its rate and trend."""
    return max(rate - settings.rate_floor, trend - settings.trend_floor, 0.0)


def _followed(rate: float, change: float, elapsed: float, time: float) -> float:
    """A rate after a ``change`` of the load, filtered over ``time`` s."""
    return rate + (change - rate * elapsed) / (elapsed + time)


def _scatter(noise: float, change: float) -> float:
    """A standard deviation after a ``change`` between two frames, each of which errs by it."""
    return math.sqrt(noise**2 + (0.5 * change**2 - noise**2) / NOISE_FRAMES)


def size_of(observation: Observation, settings: ControlSettings) -> float:
    """√(T² + (M/b)²) N, with the torque arm b under the measured normal force (elliptic limit surface)."""
    if observation.torque == 0.0 or observation.normal == 0.0:
        return observation.tangential
    arm = float(settings.contact.arm(observation.normal))
    if arm == 0.0:
        raise InvalidArgument("torque", observation.torque, "0 where the contact has no torque_arm")
    return math.hypot(observation.tangential, observation.torque / arm)
