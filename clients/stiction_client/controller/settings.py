"""Every gain of the grip controller, with unit, range and reason."""

import warnings
from dataclasses import dataclass, fields
from typing import Annotated, NamedTuple, get_type_hints

import numpy as np

from stiction_client.arguments import number, of_kind, shown, whole
from stiction_client.contacts import Contact
from stiction_client.errors import InvalidArgument
from stiction_client.planner import SLIP_PROBABILITIES, SLIP_PROBABILITY


class Gain(NamedTuple):
    """Permitted range, unit, and why the default is what it is."""

    low: float
    high: float
    unit: str
    reason: str


FRAMES = "frames"
"""The unit of what is counted, so that it is whole."""

WITHOUT_EFFECT = 0.05
"""``contradiction_share``, until it goes."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ControlSettings:
    """What a grip controller is set to; forces are those of one contact, the ``contact`` that the sensor looks at."""

    contact: Contact
    least_force: Annotated[float, Gain(1e-3, 1e3, "N", "keeps the sensor in touch")]
    most_force: Annotated[float, Gain(1e-3, 1e4, "N", "what the gripper, or the object before it breaks, can bear")]
    slip_probability: Annotated[
        float, Gain(*SLIP_PROBABILITIES, "-", "the planner's: one slip in a thousand loads")
    ] = SLIP_PROBABILITY
    touch_force: Annotated[
        float, Gain(0.0, 1e3, "N", "until a load rests: samples of slip come while it is borne; 0: `least_force`")
    ] = 0.0
    rise_rate: Annotated[float, Gain(1e-3, 1e6, "N/s", "5 N within the lag of a gripper, 30 ms")] = 150.0
    fall_rate: Annotated[
        float, Gain(1e-3, 100.0, "1/s", "half of the force in 1.4 s: a load that comes back within a task finds a grip")
    ] = 0.5
    relax_rate: Annotated[
        float, Gain(1e-3, 10.0, "1/s", "1 % a frame at 60 frames/s: a detector late by five frames costs 5 %")
    ] = 0.5
    lead_time: Annotated[
        float, Gain(0.0, 1.0, "s", "lag of a gripper, 30 ms, and two frames of sensing at 30 frames/s")
    ] = 0.1
    rate_time: Annotated[float, Gain(0.0, 1.0, "s", "two frames at 60 frames/s; the gripper's lag")] = 0.03
    rate_floor: Annotated[float, Gain(0.0, 1e3, "N/s", "0.02 N of noise at 60 frames/s, filtered so")] = 0.8
    trend_time: Annotated[float, Gain(0.0, 10.0, "s", "of a slow load: a quarter of the noise of `rate_time`")] = 0.15
    trend_floor: Annotated[float, Gain(0.0, 1e3, "N/s", "0.02 N of noise at 60 frames/s, filtered so")] = 0.2
    feel_stick_ratio: Annotated[float, Gain(0.05, 0.95, "-", "0.6 of what the contact can hold (Cattaneo-Mindlin)")] = (
        0.55
    )
    learn_stick_ratio: Annotated[
        float, Gain(0.05, 0.95, "-", "0.79 of what it can hold: a ring that slips is wide enough to be sampled")
    ] = 0.35
    told_stick_ratio: Annotated[
        float, Gain(0.05, 1.0, "-", "a thinner ring is one element wide, too little to measure friction")
    ] = 0.9
    agreement_share: Annotated[
        float, Gain(0.0, 1.0, "-", "stick taken for slip has half of it; 0.1 of the stick ratio makes 0.8")
    ] = 0.7
    moving_share: Annotated[
        float, Gain(0.0, 1.0, "-", "a ring that slips moves as one; noise moves one in ninety of what rests")
    ] = 0.2
    reflex_stick_ratio: Annotated[
        float, Gain(0.0, 0.5, "-", "0.97 of what it can hold; detectors err by 0.1 in the stick ratio")
    ] = 0.1
    reflex_gain: Annotated[
        float, Gain(0.0, 5.0, "-", "on top of the measured force: twice of it after two lags of a gripper")
    ] = 0.5
    reflex_frames: Annotated[int, Gain(1, 100, FRAMES, "a frame's error alone does not start it; 17 ms more")] = 2
    settle_time: Annotated[float, Gain(0.0, 10.0, "s", "several lags of a gripper")] = 0.2
    steady_share: Annotated[float, Gain(0.0, 1.0, "-", "load may change by that much within the lead")] = 0.05
    learn_frames: Annotated[int, Gain(2, 1000, FRAMES, "spread among fewer frames is not known to half of itself")] = 8
    learn_spread: Annotated[
        float, Gain(0.0, 0.3, "-", "relative; frames in which little slips scatter by more, and agree by chance")
    ] = 0.06
    learned_error: Annotated[
        float, Gain(0.0, 1.0, "-", "relative bias of friction from detected slip, one standard deviation")
    ] = 0.03
    sample_error: Annotated[
        float, Gain(0.0, 1.0, "-", "relative, of the friction of one slipping element, one standard deviation")
    ] = 0.13
    recognise_time: Annotated[
        float,
        Gain(0.0, 10.0, "s", "how long slip of a load is waited for, and samples add up"),
    ] = 1.0
    recognise_frames: Annotated[int, Gain(1, 100, FRAMES, "the first ones have few elements, and the same ones")] = 5
    recognise_probability: Annotated[
        float, Gain(0.5, 1.0, "-", "one in ten may be wrong: its own samples sharpen or refute it")
    ] = 0.9
    contradiction_deviations: Annotated[
        float, Gain(0.5, 10.0, "-", "of both errors: of 700 right models one is doubted for its samples")
    ] = 3.0
    contradiction_frames: Annotated[int, Gain(1, 100, FRAMES, "50 ms at 60 frames/s; one frame is wrong too often")] = 3
    contradiction_share: Annotated[
        float, Gain(0.0, 1.0, "-", "has no effect any more: samples count together, by their elements")
    ] = WITHOUT_EFFECT
    slide_deviations: Annotated[
        float,
        Gain(
            1.0, 100.0, "-", "a slide explains the load by so much better than noise, which does in none of 900 grips"
        ),
    ] = 5.0
    dropout_time: Annotated[float, Gain(1e-3, 10.0, "s", "three frames at 30 frames/s")] = 0.1
    unknown_friction: Annotated[
        float, Gain(0.01, 10.0, "-", "of what robots lift, little is more slippery: the usual fixed value")
    ] = 0.2

    def __post_init__(self) -> None:
        if self.contradiction_share != WITHOUT_EFFECT:
            warnings.warn("contradiction_share has no effect any more", DeprecationWarning, stacklevel=3)
        of_kind("contact", self.contact, Contact)
        if any(isinstance(each, np.ndarray) for each in (self.contact.area, self.contact.pressure_square)):
            raise InvalidArgument("contact", shown(self.contact), "one contact, of one area")
        for name, gain in gains().items():
            if gain.unit == FRAMES:  # 8.0 is 8, by which frames are counted off
                count = whole(name, getattr(self, name), int(gain.low), int(gain.high), gain.unit)
                object.__setattr__(self, name, count)
            else:
                number(name, getattr(self, name), gain.low, gain.high, gain.unit.removeprefix("-"))
        if self.touch_force >= self.most_force:
            raise InvalidArgument("touch_force", self.touch_force, f"less than most_force, {self.most_force:g} N")
        if self.least_force >= self.most_force:
            raise InvalidArgument("least_force", self.least_force, f"less than most_force, {self.most_force:g} N")
        if not self.reflex_stick_ratio < self.learn_stick_ratio <= self.feel_stick_ratio < self.told_stick_ratio:
            asked = "reflex_stick_ratio < learn_stick_ratio <= feel_stick_ratio < told_stick_ratio"
            raise InvalidArgument("learn_stick_ratio", self.learn_stick_ratio, asked)


def gains() -> dict[str, Gain]:
    """Range, unit and reason of each number in ``ControlSettings``, by name."""
    return dict(_GAINS)


_HINTS = get_type_hints(ControlSettings, include_extras=True)
_GAINS = {
    entry.name: _HINTS[entry.name].__metadata__[0] for entry in fields(ControlSettings) if entry.name != "contact"
}
