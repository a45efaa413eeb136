"""How hard to grip from one frame to the next, while friction is known, or being learnt."""

from typing import Final

from stiction_client.controller.controller import ControllerState, init, step
from stiction_client.controller.records import Command, Mode, Observation, SlipSamples
from stiction_client.controller.settings import ControlSettings, Gain, gains

__all__ = [
    "Command",
    "ControlSettings",
    "ControllerState",
    "Gain",
    "GraspController",
    "Mode",
    "Observation",
    "SlipSamples",
    "gains",
    "init",
    "step",
]


class GraspController:
    """The controller by its name: ``init`` makes a state, ``step`` takes a frame. It has no state of its own."""

    init: Final = staticmethod(init)
    step: Final = staticmethod(step)
