"""The loads that friction can carry, to rounding, and the tractions of sliding."""

import numpy as np

from slipcore.contact.defaults import LIMIT_SURFACE
from slipcore.contact.elasticity.fields import rigid_displacement
from slipcore.frames import BoolArray, FloatArray
from slipcore.limit_surface import Descent, LimitLoad, find_limit_load

TO_ROUNDING = Descent(
    LIMIT_SURFACE.descents, LIMIT_SURFACE.settled, LIMIT_SURFACE.still, LIMIT_SURFACE.rank, LIMIT_SURFACE.free_motion
)


def limit_load(radius: FloatArray, arm: FloatArray, load: FloatArray, given: BoolArray) -> LimitLoad:
    """How far ``load`` [3] is from the limit surface (``slipcore.limit_surface.find_limit_load``)."""
    return LimitLoad(*find_limit_load(radius, arm, load, given, TO_ROUNDING))


def sliding_traction(radius: FloatArray, arm: FloatArray, motion: FloatArray) -> FloatArray:
    """Tractions [2, n] at the Coulomb limit against a sliding ``motion`` [3] of the finger, that is along the
    object's.
    """
    along = rigid_displacement(arm, motion)
    speed = np.hypot(along[0], along[1])
    return along * (radius / np.where(speed > 0.0, speed, 1.0))
