"""Whether a contact slips as a whole, by what is found of its elements."""

import numpy as np

from slipcore.compilation import compiled
from slipcore.defaults import GROSS_SLIP
from slipcore.frames import BoolArray

_STICKING, _TOGETHER = GROSS_SLIP.sticking, GROSS_SLIP.together


@compiled
def is_gross_slip(contact: BoolArray, slip: BoolArray) -> bool:
    """Whether what touches slips as a whole, by ``contact`` and ``slip`` [n, m] of one frame.

    It does where few elements are taken to stick, and these are scattered (``GROSS_SLIP``): what still holds an object
    is one zone of stick, and a single element that seems to stick is a mistake far more often than the last to hold.
    In a sphere's contact the share of its area that sticks is (1 − Q/μP)^⅔ (Cattaneo, Mindlin), so that a twentieth is
    left at 99 % of the load that it bears.
    """
    n, m = contact.shape
    touching = sticking = together = 0
    for i in range(n):
        for j in range(m):
            touching += contact[i, j]
            if not contact[i, j] or slip[i, j]:
                continue
            sticking += 1
            for row, column in ((i - 1, j), (i + 1, j), (i, j - 1), (i, j + 1)):
                if 0 <= row < n and 0 <= column < m and contact[row, column] and not slip[row, column]:
                    together += 1
                    break
    return touching > 0 and sticking <= _STICKING * touching and together <= _TOGETHER * touching


@compiled
def find_gross_slip(contact: BoolArray, slip: BoolArray) -> BoolArray:
    """The frames [t] in which what touches slips as a whole (``is_gross_slip``), by ``contact``, ``slip`` [t, n, m]."""
    found = np.empty(len(contact), np.bool_)
    for k in range(len(contact)):
        found[k] = is_gross_slip(contact[k], slip[k])
    return found
