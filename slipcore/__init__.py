"""Tactile frames to friction samples: numerics only (frames → strain → events → slip_state → samples)."""

from slipcore.batch import Hindsight, collect_history, detect_slip
from slipcore.defaults import (
    LOOKAHEAD,
    FilterOptions,
    Option,
    SampleOptions,
    StrainRateLiteralOptions,
    StrainRateOptions,
    describe_options,
)
from slipcore.detector import DetectorState, SlipDetector
from slipcore.element_forces import ElementForces, contact_factor, element_forces, stick_ratio
from slipcore.errors import InvalidInput, NoForces, SlipcoreError, UnknownScale
from slipcore.frames import Frame, FrictionLaw, GraspLog, GroundTruth
from slipcore.methods import METHODS
from slipcore.samples import FrictionSamples, collect_samples
from slipcore.slip_state import EventList, SlipEvents, SlipHistory, SlipState
from slipcore.warm_up import warm_up

__all__ = [
    "LOOKAHEAD",
    "METHODS",
    "DetectorState",
    "ElementForces",
    "EventList",
    "FilterOptions",
    "Frame",
    "FrictionLaw",
    "FrictionSamples",
    "GraspLog",
    "GroundTruth",
    "Hindsight",
    "InvalidInput",
    "NoForces",
    "Option",
    "SampleOptions",
    "SlipDetector",
    "SlipEvents",
    "SlipHistory",
    "SlipState",
    "SlipcoreError",
    "StrainRateLiteralOptions",
    "StrainRateOptions",
    "UnknownScale",
    "collect_history",
    "collect_samples",
    "contact_factor",
    "describe_options",
    "detect_slip",
    "element_forces",
    "stick_ratio",
    "warm_up",
]
