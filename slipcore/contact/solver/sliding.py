"""Tractions of a contact that slides as a whole."""

import numpy as np

from slipcore.contact.elasticity.fields import rigid_displacement
from slipcore.frames import FloatArray


def sliding_traction(radius: FloatArray, arm: FloatArray, motion: FloatArray) -> FloatArray:
    """Tractions [2, n] at the Coulomb limit against a sliding ``motion`` [3] of the finger, that is along the
    object's.
    """
    along = rigid_displacement(arm, motion)
    speed = np.hypot(along[0], along[1])
    return along * (radius / np.where(speed > 0.0, speed, 1.0))
