"""The error of a log, from logs of the same scene on coarser grids."""

from collections.abc import Sequence
from dataclasses import astuple

import numpy as np

from slipcore.contact.defaults import ACCURACY
from slipcore.contact.tiers.difference import Difference

USUAL = Difference(ACCURACY.usual_ratio_order, ACCURACY.usual_order, ACCURACY.usual_order)
"""Powers of the cell size with which the errors fall: those of each scene, by three grids, scatter more."""


def grid_error(changes: Sequence[tuple[float, Difference]]) -> Difference:
    """What a grid leaves, with a margin, by its differences from coarser ones and the factors by which it has more
    cells across; the mean of what each of them says.
    """
    estimates = [astuple(_by_one(growth, change)) for growth, change in changes]
    return Difference(*(float(part) for part in np.mean(estimates, axis=0)))


def _by_one(growth: float, change: Difference) -> Difference:
    parts = (
        ACCURACY.safety * part / (growth**power - 1.0)
        for part, power in zip(astuple(change), astuple(USUAL), strict=True)
    )
    return Difference(*parts)


def on_finer(error: Difference, growth: float) -> Difference:
    """What is left of a grid's error with ``growth`` times the cells."""
    return Difference(*(part * growth**-power for part, power in zip(astuple(error), astuple(USUAL), strict=True)))
