"""The picture of forces over probabilities of slip, number by number."""

import math

import numpy as np
import pytest

from service.domain.planning.plan import ForceCurve
from service.web.charts import BOTTOM, HEIGHT, LEFT, RIGHT, TOP, WIDTH
from service.web.force_curve import draw_forces, probabilities


@pytest.mark.parametrize(("asked", "count", "least"), [(1e-3, 62, 1e-6), (1e-9, 61, 1e-9), (0.5, 61, 1e-6)])
def test_forces_are_computed_evenly_by_powers_of_ten_and_where_it_was_asked(
    asked: float, count: int, least: float
) -> None:
    found = probabilities(asked)
    assert len(found) == count
    assert (found[0], found[-1]) == (pytest.approx(least), pytest.approx(0.5))
    assert asked in found
    steps = np.diff(np.log(found[found != 1e-3]))
    assert steps == pytest.approx(np.full(60, math.log(0.5 / least) / 60.0))


def across(probability: float) -> float:
    return LEFT + (WIDTH - LEFT - RIGHT) * math.log(probability / 1e-6) / math.log(0.5 / 1e-6)


def up(share: float) -> float:
    return HEIGHT - BOTTOM - (HEIGHT - TOP - BOTTOM) * share


def test_the_line_is_the_smallest_force_and_the_band_reaches_to_the_largest() -> None:
    grid = np.array([1e-6, 1e-4, 1e-2, 0.5])
    chart = draw_forces(ForceCurve(grid, np.array([np.nan, 8.0, 4.0, 2.0]), np.array([np.nan, 8.8, 6.0, 9e9])), 1e-2)
    most = 8.8  # a tenth beyond the largest that is asked for
    line = [(across(p), up(f / most)) for p, f in ((1e-4, 8.0), (1e-2, 4.0), (0.5, 2.0))]
    back = [(across(0.5), up(1.0)), (across(1e-2), up(6.0 / most)), (across(1e-4), up(1.0))]
    assert chart.line == " ".join(f"{x:.1f},{y:.1f}" for x, y in line)
    assert chart.band == " ".join(f"{x:.1f},{y:.1f}" for x, y in [*line, *back])
    assert chart.without == pytest.approx((LEFT, across(1e-4)))
    assert (chart.marked, chart.marked_force) == pytest.approx((across(1e-2), up(4.0 / most)))
    assert [tick.text for tick in chart.x_ticks] == ["10⁻⁶", "10⁻⁵", "10⁻⁴", "10⁻³", "10⁻²", "10⁻¹"]
    assert [tick.place for tick in chart.x_ticks] == pytest.approx([across(10.0**k) for k in range(-6, 0)])
    assert {tick.text: tick.place for tick in chart.y_ticks}["4"] == pytest.approx(up(4.0 / most))


def test_where_none_holds_all_is_without_and_nothing_is_marked() -> None:
    grid, none = np.array([1e-6, 1e-2, 0.5]), np.full(3, np.nan)
    chart = draw_forces(ForceCurve(grid, none, none), 1e-2)
    assert (chart.line, chart.band.strip()) == ("", "")
    assert chart.without == pytest.approx((LEFT, WIDTH - RIGHT))
    assert chart.y_ticks == []
    assert chart.marked_force is None
