"""Grip by the stick ratio alone: what it says of friction before any model does."""

import math
from dataclasses import dataclass

from stiction_client.controller.friction import utilisation
from stiction_client.controller.records import Observation
from stiction_client.controller.settings import ControlSettings


@dataclass(frozen=True, slots=True)
class StickRatioEstimate:
    """The ``stick_ratio`` last observed, at ``time`` s, and the ``friction`` that it shows; NaN before any.

    ``slipping``: frames in a row in which next to nothing stuck.
    """

    time: float = -math.inf
    stick_ratio: float = math.nan
    friction: float = math.nan
    slipping: int = 0

    def step(self, observation: Observation, size: float, settings: ControlSettings) -> "StickRatioEstimate":
        """The same after a frame under a load of ``size`` N.

        A contact of which all sticks, or that bears nothing, shows no friction: what was found before then stands.
        """
        ratio = observation.stick_ratio
        if math.isnan(ratio):
            return StickRatioEstimate(self.time, math.nan, self.friction, 0)
        friction = self.friction
        if ratio < settings.told_stick_ratio and size > 0.0 and observation.normal > 0.0:
            friction = size / (observation.normal * utilisation(ratio))
        slipping = self.slipping + 1 if ratio <= settings.reflex_stick_ratio else 0
        return StickRatioEstimate(observation.time, ratio, friction, slipping)

    def required(self, load: float, stick_ratio: float, least: float = 0.0) -> float:
        """Normal force, N, under which ``load`` N leaves so much sticking; 0 while no friction was felt.

        ``least``: friction that the contact is known to have, whatever was felt.
        """
        if math.isnan(self.friction) or load == 0.0:
            return 0.0
        friction = max(self.friction, least)
        return load / (friction * utilisation(stick_ratio)) if friction > 0.0 else math.inf

    def slips(self, settings: ControlSettings) -> bool:
        """Whether next to nothing sticks, and not by an error of one frame."""
        return self.slipping >= settings.reflex_frames
