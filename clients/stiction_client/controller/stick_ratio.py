"""Grip by the stick ratio alone: what it says of friction before any model does."""

import math
from dataclasses import dataclass, replace

from stiction_client.controller.friction import utilisation
from stiction_client.controller.load import LoadEstimate
from stiction_client.controller.records import Observation
from stiction_client.controller.settings import ControlSettings
from stiction_client.defaults import BORNE, FALL, FALL_FRAMES, REST_FRAMES, TAKEN_AWAY


@dataclass(frozen=True, slots=True)
class StickRatioEstimate:
    """The ``stick_ratio`` last observed, at ``time`` s, and the ``friction`` that it shows; NaN before any.

    ``slipping``: frames in a row in which next to nothing stuck; ``bore``: the largest load over force that the contact
    bore, which its friction is no less than; ``highest``: the same of the ``load``, N, a mean, that is at rest now:
    while it is pressed harder, all of it sticks (Mindlin and Deresiewicz, 1953), and a detector may go on seeing what
    slipped before. Then the stick ratio ``shows`` nothing. ``before_rest``: the friction that it showed
    before the load came to rest. ``used``: the share of what the contact can bear, by the latest stick ratios.
    """

    time: float = -math.inf
    stick_ratio: float = math.nan
    friction: float = math.nan
    slipping: int = 0
    bore: float = 0.0
    highest: float = 0.0
    load: float = 0.0
    shows: bool = True
    before_rest: float = math.nan
    used: tuple[float, ...] = ()

    def step(self, observation: Observation, load: LoadEstimate, settings: ControlSettings) -> "StickRatioEstimate":
        """The same after a frame under a ``load``.

        A contact of which all sticks, or that bears nothing, shows no friction: what was found before then stands.
        """
        mean, bears, highest, shows = self._borne(observation.normal, load, settings)
        ratio, friction = observation.stick_ratio, self.friction
        if shows and bears > 0.0 and ratio < settings.told_stick_ratio:
            friction = bears / utilisation(ratio)
        if mean == 0.0:
            bore = 0.0
        else:
            bore = bears if self.slips(settings) else max(self.bore, bears - load.noise / observation.normal)
        slipping = self.slipping + 1 if ratio <= settings.reflex_stick_ratio else 0
        time = self.time if math.isnan(ratio) else observation.time
        before_rest = self.before_rest if math.isfinite(load.steady) else friction
        used = () if math.isnan(ratio) else (*self.used, utilisation(ratio))[-FALL_FRAMES - 1 :]
        return StickRatioEstimate(time, ratio, friction, slipping, bore, highest, mean, shows, before_rest, used)

    def confirmed(self) -> "StickRatioEstimate":
        """With no less friction than was shown before the load came to rest: none where none was shown."""
        return self if self.friction > self.before_rest else replace(self, friction=self.before_rest)

    def _borne(self, normal: float, load: LoadEstimate, settings: ControlSettings) -> tuple[float, float, float, bool]:
        """The ``load``, of one at rest the mean, what it is of the force, and with it ``highest`` and ``shows``."""
        if normal == 0.0 or not load.loads(settings):
            return 0.0, load.size / normal if normal else 0.0, 0.0, True
        rests = math.isfinite(load.steady) and 0.0 < self.load <= load.size + TAKEN_AWAY * load.noise
        mean = self.load + (load.size - self.load) / REST_FRAMES if rests else load.size
        bears = mean / normal
        highest = max(self.highest if rests else 0.0, bears)
        return mean, bears, highest, bears >= (1.0 - settings.steady_share) * highest

    def least(self, settings: ControlSettings) -> float:
        """The least friction that the contact may have: what most objects have, or by what it bore."""
        return max(settings.unknown_friction, BORNE * self.bore)

    def required(self, load: float, stick_ratio: float, least: float = 0.0) -> float:
        """Normal force, N, under which ``load`` N leaves so much sticking; 0 while no friction was felt.

        ``least``: friction that the contact is known to have, whatever was felt.
        """
        if math.isnan(self.friction) or load == 0.0:
            return 0.0
        friction = max(self.friction, least)
        return load / (friction * utilisation(stick_ratio)) if friction > 0.0 else math.inf

    def falls(self, settings: ControlSettings) -> bool:
        """Whether the stick ratio falls sooner than a grip that is being relaxed makes it, below ``feel_stick_ratio``.

        Above it a ring that slipped before a grip was pressed again comes back as soon.
        """
        return self.stick_ratio <= settings.feel_stick_ratio and self.used[-1] - min(self.used) > FALL

    def slips(self, settings: ControlSettings) -> bool:
        """Whether next to nothing sticks, and not by an error of one frame."""
        return self.slipping >= settings.reflex_frames
