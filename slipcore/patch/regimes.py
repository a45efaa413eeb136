"""What patches do: stick, slip in part, slide, pivot, or roll."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from slipcore.compilation import compiled
from slipcore.defaults import PatchOptions
from slipcore.frames import BoolArray
from slipcore.patch.motion import PatchMotion
from slipcore.patch.plateau import SteadySliding
from slipcore.patch.spans import IntArray, Spans, elements_at, for_kernels
from slipcore.patch_record import MACRO_SLIP, REGIMES, Patch, frames_of, joined


def regimes(
    spans: Spans, slip: BoolArray, motion: PatchMotion, steady: SteadySliding, options: PatchOptions
) -> NDArray[np.str_]:
    """One of ``REGIMES`` for each frame of the patches, [k], of whose elements some ``slip`` [t, n, m].

    A patch that travels over the lattice without a load at its limit rolls or rocks; one that turns so, or of which
    some elements slip, slips in part.
    """
    counts = np.zeros((len(spans.frame), 2), np.int64)
    _fill_counts(spans, for_kernels(slip), counts)
    elements, slipping = counts.T
    cases = {
        "none": elements == 0,
        "pivoting": steady.pivoting,
        "sliding": steady.sliding,
        "rolling": motion.wanders & ~motion.turns,
        "incipient": (slipping > options.slip_share * elements) | motion.turns | motion.travels,
    }
    found: NDArray[np.str_] = np.select(list(cases.values()), list(cases), "stick").astype(
        f"<U{max(map(len, REGIMES))}"
    )
    return found


@compiled
def _fill_counts(spans: Spans, slip: BoolArray, counts: IntArray) -> None:
    """How many elements each frame [k, 2] of a patch has, and how many of them slip."""
    for e, k in enumerate(spans.frame):
        for i, j in elements_at(spans, e):
            counts[e, 0] += 1
            counts[e, 1] += slip[k, i, j]


def slips_as_a_whole(patches: Sequence[Patch], frames: int) -> BoolArray:
    """Frames [t] in which all patches that touch slide or pivot."""
    some, others = np.zeros(frames, bool), np.zeros(frames, bool)
    if patches:
        regime, frame = joined(patches, "regime"), frames_of(patches)
        slips = np.logical_or.reduce([regime == each for each in MACRO_SLIP])
        some[frame[slips]] = True
        others[frame[(regime != "none") & ~slips]] = True
    return some & ~others
