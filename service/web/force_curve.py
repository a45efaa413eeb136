"""The picture of the planner's answer: normal force over the slip probability that is accepted."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from service.domain.planning.plan import ForceCurve
from service.web.charts import BOTTOM, HEIGHT, LEFT, RIGHT, TOP, WIDTH, Tick, rounded, ticks

LEAST, MOST = 1e-6, 0.5
"""Slip probabilities between which forces are drawn: of a grasp in a million, and the largest that may be asked for."""

POINTS = 61

ABOVE_ASKED = 5.0
"""How many times the force that was asked for the axis reaches at most: at small probabilities it may be any."""

_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


@dataclass(frozen=True, slots=True)
class ForceChart:
    """The numbers of an SVG: the smallest force that holds as a line, all that hold as a band up to the largest.

    ``without``: from where to where no force holds, None where some always does; ``marked``: what was asked, and
    ``marked_force``, where it stands, None where none holds.
    """

    line: str
    band: str
    without: tuple[float, float] | None
    marked: float
    marked_force: float | None
    x_ticks: Sequence[Tick]
    y_ticks: Sequence[Tick]

    width, height, left, right, top, bottom = WIDTH, HEIGHT, LEFT, WIDTH - RIGHT, TOP, HEIGHT - BOTTOM


def probabilities(asked: float) -> NDArray[np.float64]:
    """Where the curve is computed [n]: evenly by powers of ten, and where it was asked for."""
    return np.unique([*np.geomspace(min(LEAST, asked), MOST, POINTS), asked])


def draw_forces(curve: ForceCurve, asked: float) -> ForceChart:
    """The chart of a curve on ``probabilities(asked)``; the smaller the probability, the less does any force hold."""
    holds = np.isfinite(curve.smallest)
    at_asked = float(curve.smallest[curve.slip_probability == asked][0])
    y_most = _y_most(curve.smallest[holds], at_asked)
    x_least = float(curve.slip_probability[0])

    def across(probability: float) -> float:
        return LEFT + (WIDTH - LEFT - RIGHT) * math.log(probability / x_least) / math.log(MOST / x_least)

    def up(force: float) -> float:
        return HEIGHT - BOTTOM - (HEIGHT - TOP - BOTTOM) * min(force / y_most, 1.0)

    def points(forces: NDArray[np.float64], order: slice) -> str:
        drawn = zip(curve.slip_probability[shown][order], forces[shown][order], strict=True)
        return " ".join(f"{across(p):.1f},{up(f):.1f}" for p, f in drawn)

    shown = holds & (np.nan_to_num(curve.smallest) <= y_most)
    forward, back = slice(None), slice(None, None, -1)
    first = float(curve.slip_probability[holds][0]) if holds.any() else MOST
    return ForceChart(
        line=points(curve.smallest, forward),
        band=f"{points(curve.smallest, forward)} {points(curve.largest, back)}",
        without=None if holds.all() else (LEFT, across(first)),
        marked=across(asked),
        marked_force=up(at_asked) if math.isfinite(at_asked) else None,
        x_ticks=[Tick(across(10.0**power), f"10{str(power).translate(_RAISED)}") for power in _powers(x_least)],
        y_ticks=[Tick(up(y), f"{y:g}") for y in rounded(ticks(0.0, y_most))] if holds.any() else [],
    )


def _y_most(forces: NDArray[np.float64], asked: float) -> float:
    """Up to where the axis goes, N."""
    highest = float(forces.max(initial=1e-9))
    return 1.1 * (min(highest, ABOVE_ASKED * asked) if asked > 0.0 else highest)


def _powers(least: float) -> range:
    """Of ten, between the ends of the axis."""
    return range(math.ceil(math.log10(least) - 1e-9), 0)
