"""What is assumed of traction before any marker is seen: a Gaussian field, alike everywhere on its support."""

from typing import NamedTuple

import numpy as np
from scipy.spatial.distance import cdist

from slipcore.forces.defaults import PRIOR
from slipcore.frames import FloatArray


class Smoothness(NamedTuple):
    """Shape of the prior: correlation lengths of ``pressure`` and of ``traction``, in pitches (Matérn 3/2: slopes
    exist, curvature need not), and the standard deviation of either tangential component as a ``shear`` of that of
    pressure; ``falls``: whether pressure is known to fall to zero at the nodes around its support.
    """

    pressure: float
    traction: float
    shear: float
    falls: bool = False


def usual() -> Smoothness:
    """Where the choice begins, and what is taken where nothing is chosen."""
    return Smoothness(PRIOR.pressure_length, PRIOR.traction_length, PRIOR.shear)


def of_depth_alone() -> Smoothness:
    """Where it begins for displacement along the normal alone, in which shear could stand for pressure."""
    return usual()._replace(shear=PRIOR.unseen_shear)


def choices() -> dict[str, tuple[float, ...]]:
    """Values of each property of a prior's shape among which the data choose."""
    pressure, traction, shear, _ = usual()
    return {
        "pressure": (pressure / PRIOR.length_factor, pressure, pressure * PRIOR.length_factor),
        "traction": (traction / PRIOR.length_factor, traction, traction * PRIOR.length_factor),
        "shear": (PRIOR.least_shear, shear, PRIOR.largest_shear),
    }


def factors(places: FloatArray, pitch: float, smoothness: Smoothness, rim: FloatArray | None = None) -> FloatArray:
    """L [3, k, k], lower triangular: L Lᵀ is the prior covariance of q_x, q_y and p at ``places`` [k, 2] m, for a
    pressure of standard deviation 1, in root mean square where it is zero at a ``rim`` [r, 2] m.
    """
    around = places[:0] if rim is None else rim
    known, whole = len(around), np.concatenate((around, places))
    apart = cdist(whole, whole) / pitch
    traction = smoothness.shear * _factor(apart[known:, known:] / smoothness.traction)
    pressure = _factor(apart / smoothness.pressure)[known:, known:]
    if known:
        pressure *= np.sqrt(len(places)) / np.linalg.norm(pressure)
    return np.stack((traction, traction, pressure))


def _factor(apart: FloatArray) -> FloatArray:
    reach = np.sqrt(3.0) * apart
    return np.linalg.cholesky((1.0 + reach) * np.exp(-reach) + PRIOR.jitter * np.eye(len(apart)))
