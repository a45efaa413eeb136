"""A detector of one's own: an element slips once it has moved so far from the mean of the contact.

    python examples/add_a_detector.py

In the package it would be a file of `slipcore/detection/baselines/` with a line in `slipcore/detection/methods.py`.
"""

from dataclasses import dataclass
from typing import Annotated

import numpy as np

import slipcore
from slipcore.contact import tangential_ramp
from slipcore.defaults import ContactOptions
from slipcore.detection.baselines.since_touch import threshold_method
from slipcore.detection.shared.interface import ObservedFrame
from slipcore.frames import BoolArray, FloatArray
from slipcore.options import Option
from slipcore.surface.strain import Lattice


@dataclass(frozen=True, slots=True, kw_only=True)
class Options(ContactOptions):
    """Each option has its unit, range and source; the detector checks them."""

    distance: Annotated[float, Option(0.0, 0.1, "m", "a guess, for this example")] = 3e-5
    """Least distance from the mean displacement of the contact."""


def measure(_: Lattice, seen: ObservedFrame) -> FloatArray:
    """Displacement in the plane [2, n, m] m; the framework takes the difference since the touch."""
    return np.moveaxis(seen.displacement[..., :2], -1, 0)


def slips(_: Lattice, seen: ObservedFrame, change: FloatArray, options: Options) -> BoolArray:
    """Slip [n, m] of each element."""
    if not seen.stays.any():
        return np.zeros(seen.contact.shape, bool)
    away = change - change[:, seen.stays].mean(axis=1)[:, None, None]
    return np.hypot(*away) > options.distance


slipcore.METHODS["far_from_mean"] = threshold_method(Options, measure, slips)

log = tangential_ramp(friction=0.4, points=12, pitch=1e-3, seed=1)
for method in ("filter", "far_from_mean"):
    found = slipcore.detect_slip(log, method)
    right = np.mean((found.slip == log.truth.slip_kinematic)[log.truth.contact])
    print(f"{method}: right for {100.0 * right:.0f} % of the elements in contact")
