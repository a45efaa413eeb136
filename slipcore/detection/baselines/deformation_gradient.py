"""Threshold on the gradient of the deformation field, after Sui et al. 2022 (the paper's [27]).

Meant for soft objects, which strain even where they stick. Its exact threshold is not in public sources; assumed here:
Frobenius norm of the displacement gradient since the touch, without the rotation that is common to the contact, over a
threshold that is a share of the largest in the contact, with a least value.
"""

import numpy as np

from slipcore.defaults import DeformationGradientOptions
from slipcore.detection.baselines.since_touch import threshold_method
from slipcore.detection.shared.interface import ObservedFrame
from slipcore.frames import BoolArray, FloatArray
from slipcore.surface.strain import Lattice, displacement_gradient, lattice_steps


def measure(lattice: Lattice, seen: ObservedFrame) -> FloatArray:
    """Displacement gradient [2, 2, n, m]."""
    return displacement_gradient(lattice, lattice_steps(seen.displacement))


def slips(_: Lattice, seen: ObservedFrame, change: FloatArray, options: DeformationGradientOptions) -> BoolArray:
    """Norm of the change of gradient against a threshold tied to the field."""
    if not seen.contact.any():
        return seen.contact
    turn = np.median(0.5 * (change[1, 0] - change[0, 1])[seen.contact])
    (xx, xy), (yx, yy) = change
    norm = np.sqrt(xx**2 + yy**2 + (yx - turn) ** 2 + (xy + turn) ** 2)
    slip: BoolArray = norm > max(options.least_gradient, options.share * float(norm[seen.contact].max()))
    return slip


METHOD = threshold_method(DeformationGradientOptions, measure, slips)
