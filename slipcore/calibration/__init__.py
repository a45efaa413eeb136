"""Faults of a sensor, learnt from presses of a body straight down, and taken out of its logs."""

import warnings

from slipcore.calibration.calibrate import calibrate_sensor
from slipcore.calibration.estimate import Estimate
from slipcore.calibration.model import Corrected, SensorModel
from slipcore.calibration.press import InvalidPress

__all__ = ["Corrected", "Estimate", "InvalidPress", "SensorModel", "calibrate_sensor"]


def __getattr__(name: str) -> object:
    """The former name of ``InvalidPress`` is understood until the next version."""
    if name == "ImpurePress":
        warnings.warn("slipcore.calibration.ImpurePress is now InvalidPress", DeprecationWarning, stacklevel=2)
        return InvalidPress
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
