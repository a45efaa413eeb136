"""What a patch does: stick, slip in part, slide, pivot, or roll."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from slipcore.defaults import PatchOptions
from slipcore.frames import BoolArray
from slipcore.patch.motion import Motion
from slipcore.patch.plateau import Plateaus
from slipcore.patch_record import MACRO_SLIP, REGIMES, Patch


def regimes(
    patch: BoolArray, slip: BoolArray, motion: Motion, plateaus: Plateaus, options: PatchOptions
) -> NDArray[np.str_]:
    """One of ``REGIMES`` for each frame, [t], of elements in the ``patch`` and elements that ``slip`` [t, n, m].

    A patch that travels over the lattice without a load at its limit rolls or rocks; one that turns so, or of which
    some elements slip, slips in part.
    """
    elements = patch.sum(axis=(1, 2))
    some_slip = (patch & slip).sum(axis=(1, 2)) > options.slip_share * elements
    cases = {
        "none": elements == 0,
        "pivoting": plateaus.pivoting,
        "sliding": plateaus.sliding,
        "rolling": motion.wanders & ~motion.turns,
        "incipient": some_slip | motion.turns | motion.travels,
    }
    found: NDArray[np.str_] = np.select(list(cases.values()), list(cases), "stick").astype(
        f"<U{max(map(len, REGIMES))}"
    )
    return found


def slips_as_a_whole(patches: Sequence[Patch], frames: int) -> BoolArray:
    """Frames [t] in which all patches that touch slide or pivot."""
    some, others = np.zeros(frames, bool), np.zeros(frames, bool)
    for patch in patches:
        slips = np.isin(patch.regime, MACRO_SLIP)
        some[patch.frames] |= slips
        others[patch.frames] |= (patch.regime != "none") & ~slips
    return some & ~others
