"""Forces on micro-elements from the displacement of markers, for sensors that measure no forces."""

from slipcore.forces.comparison import Agreement, ForceComparison, compare_forces
from slipcore.forces.frame_forces import FrameForces
from slipcore.forces.gel import Gel
from slipcore.forces.gel_calibration import GelCalibration, GelEstimate, calibrate_gel
from slipcore.forces.reconstruction import Reconstruction, reconstruct
from slipcore.forces.stream import ForceStream, StreamedForces

__all__ = [
    "Agreement",
    "ForceComparison",
    "ForceStream",
    "FrameForces",
    "Gel",
    "GelCalibration",
    "GelEstimate",
    "Reconstruction",
    "StreamedForces",
    "calibrate_gel",
    "compare_forces",
    "reconstruct",
]
