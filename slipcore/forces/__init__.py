"""Forces on micro-elements from the displacement of markers, for sensors that measure no forces."""

from slipcore.forces.gel_calibration.calibrate import GelCalibration, GelEstimate, calibrate_gel
from slipcore.forces.inverse.kernel import ResolutionKernel
from slipcore.forces.operator.gel import Gel
from slipcore.forces.reconstruction.comparison import Agreement, ForceComparison, compare_forces
from slipcore.forces.reconstruction.stream import ForceStream, StreamedForces
from slipcore.forces.reconstruction.whole_log import Reconstruction, reconstruct
from slipcore.forces.tracking.frame_forces import FrameForces

__all__ = [
    "Agreement",
    "ForceComparison",
    "ForceStream",
    "FrameForces",
    "Gel",
    "GelCalibration",
    "GelEstimate",
    "Reconstruction",
    "ResolutionKernel",
    "StreamedForces",
    "calibrate_gel",
    "compare_forces",
    "reconstruct",
]
