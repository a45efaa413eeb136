"""The plain comparison: an element slips once its strain has changed by so much since it touched."""

from slipcore.defaults import StrainThresholdOptions
from slipcore.detection.baselines.since_touch import threshold_method
from slipcore.detection.shared.interface import ObservedFrame
from slipcore.frames import BoolArray, FloatArray
from slipcore.surface.strain import Lattice, displacement_gradient, frobenius, green_lagrange, lattice_steps


def measure(lattice: Lattice, seen: ObservedFrame) -> FloatArray:
    """Green–Lagrange strain [3, n, m]."""
    return green_lagrange(displacement_gradient(lattice, lattice_steps(seen.displacement)))


def slips(_: Lattice, __: ObservedFrame, change: FloatArray, options: StrainThresholdOptions) -> BoolArray:
    """Frobenius norm of the change of strain, against a threshold."""
    return frobenius(change) > options.threshold


METHOD = threshold_method(StrainThresholdOptions, measure, slips)
