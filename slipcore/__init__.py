"""Tactile frames to friction samples: numerics only (frames → strain → events → slip_state → samples)."""

from slipcore.defaults import (
    FilterOptions,
    Option,
    SampleOptions,
    StrainRateLiteralOptions,
    StrainRateOptions,
    describe_options,
)
from slipcore.detector import DetectorState, SlipDetector, collect_history, detect_slip
from slipcore.element_forces import ElementForces, contact_factor, element_forces, stick_ratio
from slipcore.errors import InvalidInput, NoForces, SlipcoreError, UnknownScale
from slipcore.frames import Frame, FrictionLaw, GraspLog, GroundTruth
from slipcore.methods import METHODS
from slipcore.samples import FrictionSamples, collect_samples
from slipcore.slip_state import EventList, SlipEvents, SlipHistory, SlipState
from slipcore.warm_up import warm_up

__all__ = [
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
