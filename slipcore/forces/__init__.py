"""Forces on micro-elements from the displacement of markers, for sensors that measure no forces."""

from slipcore.forces.comparison import Agreement, ForceComparison, compare_forces
from slipcore.forces.gel import Gel
from slipcore.forces.gel_calibration import GelCalibration, GelEstimate, calibrate_gel
from slipcore.forces.reconstruction import Reconstruction, reconstruct

__all__ = [
    "Agreement",
    "ForceComparison",
    "Gel",
    "GelCalibration",
    "GelEstimate",
    "Reconstruction",
    "calibrate_gel",
    "compare_forces",
    "reconstruct",
]
