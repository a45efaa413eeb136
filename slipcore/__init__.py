"""Tactile frames to friction samples: numerics only (frames → strain → events → slip_state → samples)."""

import warnings
from importlib import import_module
from importlib.metadata import version
from typing import TYPE_CHECKING

from slipcore.checks import Finding, check_log
from slipcore.collection import Collected, collect_friction, collect_samples
from slipcore.defaults import (
    LOOKAHEAD,
    CheckOptions,
    FilterOptions,
    PatchOptions,
    SampleOptions,
    StrainRateLiteralOptions,
    StrainRateOptions,
)
from slipcore.detection.reconstructed_forces import for_reconstructed_forces
from slipcore.element_forces import ElementForces, contact_factor, element_forces, stick_ratio
from slipcore.errors import InvalidInput, NoForces, SlipcoreError, UnknownScale
from slipcore.frames import Frame, FrictionLaw, GraspLog, GroundTruth
from slipcore.method_choice import recommended_method
from slipcore.options import Option, describe_options
from slipcore.patch.friction import contact_friction
from slipcore.patch_record import ContactFriction, Patch
from slipcore.samples import FrictionSamples
from slipcore.slip_state import EventList, SlipEvents, SlipHistory, SlipState
from slipcore.warm_up import warm_up

if TYPE_CHECKING:
    from slipcore.calibration import Estimate, InvalidPress, SensorModel, calibrate_sensor
    from slipcore.detection.batch import FixedLagSmoother, collect_history, detect_slip
    from slipcore.detection.detector import DetectorState, SlipDetector
    from slipcore.detection.methods import METHODS

_LAZY = {
    "Estimate": "slipcore.calibration",
    "InvalidPress": "slipcore.calibration",
    "SensorModel": "slipcore.calibration",
    "calibrate_sensor": "slipcore.calibration",
    "FixedLagSmoother": "slipcore.detection.batch",
    "collect_history": "slipcore.detection.batch",
    "detect_slip": "slipcore.detection.batch",
    "DetectorState": "slipcore.detection.detector",
    "SlipDetector": "slipcore.detection.detector",
    "METHODS": "slipcore.detection.methods",
}
"""Names whose modules load compiled kernels, a second of work: who only holds logs and results goes without."""
_DEPRECATED = {"Hindsight": "FixedLagSmoother", "ImpurePress": "InvalidPress"}
"""Former names, understood until the next version."""

__version__ = version("stiction")

__all__ = [
    "LOOKAHEAD",
    "METHODS",
    "CheckOptions",
    "Collected",
    "ContactFriction",
    "DetectorState",
    "ElementForces",
    "Estimate",
    "EventList",
    "FilterOptions",
    "Finding",
    "FixedLagSmoother",
    "Frame",
    "FrictionLaw",
    "FrictionSamples",
    "GraspLog",
    "GroundTruth",
    "InvalidInput",
    "InvalidPress",
    "NoForces",
    "Option",
    "Patch",
    "PatchOptions",
    "SampleOptions",
    "SensorModel",
    "SlipDetector",
    "SlipEvents",
    "SlipHistory",
    "SlipState",
    "SlipcoreError",
    "StrainRateLiteralOptions",
    "StrainRateOptions",
    "UnknownScale",
    "calibrate_sensor",
    "check_log",
    "collect_friction",
    "collect_history",
    "collect_samples",
    "contact_factor",
    "contact_friction",
    "describe_options",
    "detect_slip",
    "element_forces",
    "for_reconstructed_forces",
    "recommended_method",
    "stick_ratio",
    "warm_up",
]


def __getattr__(name: str) -> object:
    """A public name's module is loaded when the name is first asked for (PEP 562)."""
    if name in _DEPRECATED:
        warnings.warn(f"slipcore.{name} is now {_DEPRECATED[name]}", DeprecationWarning, stacklevel=2)
        name = _DEPRECATED[name]
    if name not in _LAZY:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = globals()[name] = getattr(import_module(_LAZY[name]), name)
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
