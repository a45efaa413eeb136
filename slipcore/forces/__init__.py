"""Forces on micro-elements from the displacement of markers, for sensors that measure no forces."""

from slipcore.forces.gel import Gel
from slipcore.forces.reconstruction import Reconstruction, reconstruct

__all__ = ["Gel", "Reconstruction", "reconstruct"]
