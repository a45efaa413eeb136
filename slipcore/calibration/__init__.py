"""Faults of a sensor, learnt from presses of a body straight down, and taken out of its logs."""

from slipcore.calibration.calibrate import calibrate_sensor
from slipcore.calibration.estimate import Estimate
from slipcore.calibration.model import Corrected, SensorModel
from slipcore.calibration.press import ImpurePress

__all__ = ["Corrected", "Estimate", "ImpurePress", "SensorModel", "calibrate_sensor"]
