"""How far a load is from the limit surface (``slipcore.limit_surface``), to rounding: as the solver needs it."""

import numpy as np

from slipcore.contact.defaults import LIMIT_SURFACE
from slipcore.frames import BoolArray, FloatArray
from slipcore.limit_surface import Descent, LimitLoad, find_limit_load

TO_ROUNDING = Descent(
    LIMIT_SURFACE.descents, LIMIT_SURFACE.settled, LIMIT_SURFACE.still, LIMIT_SURFACE.rank, LIMIT_SURFACE.free_motion
)


def limit_load(radius: FloatArray, arm: FloatArray, load: FloatArray, given: BoolArray) -> LimitLoad:
    """How far ``load`` [3] is from the limit surface (``slipcore.limit_surface.find_limit_load``)."""
    return LimitLoad(*find_limit_load(radius, np.ascontiguousarray(arm), load, given, TO_ROUNDING))
