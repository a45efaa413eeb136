"""Tactile frames to friction samples: numerics only (frames → strain → events → slip_state → samples)."""

from slipcore.errors import InvalidInput, NoForces, SlipcoreError
from slipcore.frames import Frame, FrictionLaw, GraspLog, GroundTruth
from slipcore.samples import FrictionSamples
from slipcore.slip_state import EventList, SlipEvents, SlipHistory, SlipState

__all__ = [
    "EventList",
    "Frame",
    "FrictionLaw",
    "FrictionSamples",
    "GraspLog",
    "GroundTruth",
    "InvalidInput",
    "NoForces",
    "SlipEvents",
    "SlipHistory",
    "SlipState",
    "SlipcoreError",
]
