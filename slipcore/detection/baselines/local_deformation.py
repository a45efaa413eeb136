"""Local degree of deformation, after Zhang et al. 2023 (the paper's [26]).

The displacement field is compared locally: where markers move alike the surface sticks. Its exact measure is not in
public sources; assumed here: the root mean square, over rows and columns, of the relative displacement of an element's
opposite neighbours since it touched, over their distance, against a threshold. The paper: it holds on to the first slip
when the normal force rises.
"""

import numpy as np

from slipcore.defaults import LocalDeformationOptions
from slipcore.detection.baselines.since_touch import threshold_method
from slipcore.detection.shared.interface import ObservedFrame
from slipcore.frames import BoolArray, FloatArray
from slipcore.surface.strain import Lattice, lattice_steps


def measure(_: Lattice, seen: ObservedFrame) -> FloatArray:
    """Relative displacement in the plane of opposite neighbours [2 (along), 2, n, m] m."""
    return lattice_steps(seen.displacement)[:, :2]


def slips(lattice: Lattice, _: ObservedFrame, change: FloatArray, options: LocalDeformationOptions) -> BoolArray:
    """Root mean square relative displacement per distance, against a threshold."""
    share = (change**2).sum(axis=1) / (lattice.steps**2).sum(axis=1)
    degree = np.sqrt(share.mean(axis=0))
    more: BoolArray = degree > options.threshold
    return more


METHOD = threshold_method(LocalDeformationOptions, measure, slips)
