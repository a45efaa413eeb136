"""The error of a log, from logs of the same scene on coarser grids."""

from dataclasses import astuple

import numpy as np

from slipcore.contact.defaults import ACCURACY
from slipcore.contact.tiers.difference import Difference

USUAL = Difference(ACCURACY.usual_ratio_order, ACCURACY.usual_order, ACCURACY.usual_order)
"""Powers of the cell size with which the errors fall, where two grids are all there is."""


def orders(before: Difference, change: Difference, cells: tuple[int, int, int]) -> Difference:
    """Powers of the cell size that explain the changes between three grids: ``before`` that from the first to the
    second, ``change`` from there to the third, ``cells`` across each; within what is seen of fine grids.
    """
    found = (_order(*pair, cells) for pair in zip(astuple(before), astuple(change), strict=True))
    return Difference(*found)


def _order(before: float, change: float, cells: tuple[int, int, int]) -> float:
    low, high = ACCURACY.least_order, ACCURACY.largest_order
    if change <= 0.0 or before <= 0.0:
        return low
    tried = np.linspace(low, high, ACCURACY.tried_orders)
    first, second, third = (float(count) ** -tried for count in cells)
    ratio = (first - second) / (second - third)  # rises with the order
    return float(np.interp(before / change, ratio, tried))


def grid_error(change: Difference, growth: float, order: Difference = USUAL) -> Difference:
    """What the finer of two grids leaves, whose cells are ``growth`` apart, with a margin."""
    parts = (
        ACCURACY.safety * part / (growth**power - 1.0)
        for part, power in zip(astuple(change), astuple(order), strict=True)
    )
    return Difference(*parts)


def on_finer(error: Difference, growth: float, order: Difference = USUAL) -> Difference:
    """What is left of a grid's error with ``growth`` times the cells."""
    return Difference(*(part * growth**-power for part, power in zip(astuple(error), astuple(order), strict=True)))
