"""Forces on micro-elements, split at the surface, and what follows from them."""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from slipcore.errors import InvalidInput
from slipcore.frames import BoolArray, FloatArray


class ElementForces(NamedTuple):
    """Force on each element, split at the surface: [..., n, m] N, both as magnitudes.

    ``compressive``: where the normal part presses inwards; only there is ``normal`` a contact force.
    """

    normal: FloatArray
    tangential: FloatArray
    compressive: BoolArray

    @property
    def pressing(self) -> FloatArray:
        """Normal force with its sign, positive where it presses inwards: [..., n, m] N."""
        return np.where(self.compressive, self.normal, -self.normal)


def element_forces(force: FloatArray, normal: FloatArray) -> ElementForces:
    """Split force [..., n, m, 3] N at the outward unit normal [..., n, m, 3].

    f_n = |f·n| and f_t = |f − (f·n) n| (paper, eq. 38–39 as magnitudes).
    """
    (x, y, z), (a, b, c) = np.moveaxis(force, -1, 0), np.moveaxis(normal, -1, 0)
    along = x * a + y * b + z * c
    x, y, z = x - along * a, y - along * b, z - along * c
    return ElementForces(np.abs(along), np.sqrt(x * x + y * y + z * z), along < 0.0)


def contact_factor(tangential_force: ArrayLike, normal_force: ArrayLike, friction_coefficient: ArrayLike) -> FloatArray:
    """Contact factor f_t/(μ f_n) (paper, eq. 36): 1 at the Coulomb limit, NaN where f_n = 0; shapes broadcast.

    Raises ``InvalidInput`` for a friction coefficient that is not above 0.
    """
    coefficient = np.asarray(friction_coefficient, float)
    if not (coefficient > 0.0).all():
        raise InvalidInput("friction_coefficient", coefficient.min(), "above 0")
    f_t, limit = np.broadcast_arrays(np.asarray(tangential_force, float), coefficient * np.asarray(normal_force, float))
    factor: FloatArray = np.divide(f_t, limit, out=np.full(f_t.shape, np.nan), where=limit > 0.0)
    return factor


def stick_ratio(contact: BoolArray, slip: BoolArray) -> float:
    """Stick area over contact area S_c/S_a (paper, eq. 37 corrected), elements of one area; NaN without contact."""
    touching = np.count_nonzero(contact)
    return 1.0 - np.count_nonzero(contact & slip) / touching if touching else float("nan")
