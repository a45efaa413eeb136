import re

import numpy as np
import pytest

from service.domain.plan import ForceCurve
from service.web.charts import HEIGHT, WIDTH, Curve, draw, draw_together, ticks
from service.web.force_curve import draw_forces, probabilities


def curve(high: float = 0.5, marked: float = 0.5) -> Curve:
    return Curve([0.0, 1.0], [0.4, 0.4], [0.3, -0.3], [0.5, high], (0.2, 0.8), marked, "x", "y", "title")


@pytest.mark.parametrize(
    ("low", "high", "expected"),
    [
        (0.0, 1.0, [0, 0.2, 0.4, 0.6, 0.8, 1.0]),
        (0.0, 0.27, [0, 0.1, 0.2]),
        (0.0, 7e-4, [0, 2e-4, 4e-4, 6e-4]),
        (2.0, 3.0, [2, 2.2, 2.4, 2.6, 2.8, 3]),
    ],
)
def test_ticks_are_round_numbers(low: float, high: float, expected: list[float]) -> None:
    assert ticks(low, high) == pytest.approx(expected)


def test_ticks_of_next_to_nothing_are_at_its_beginning() -> None:
    assert ticks(0.0, 5e-324) == [0.0]


@pytest.mark.parametrize("high", [0.5, 1e-9, 1e9])
def test_everything_is_drawn_inside_of_the_picture(high: float) -> None:
    chart = draw(curve(high, marked=3.0))
    numbers = [tuple(map(float, point.split(","))) for point in f"{chart.line} {chart.band}".split()]
    assert all(0.0 <= x <= WIDTH and 0.0 <= y <= HEIGHT for x, y in numbers)
    assert chart.left <= chart.marked <= chart.right


def test_a_line_stands_where_its_axis_says() -> None:
    chart = draw(curve())
    height = {tick.text: tick.place for tick in chart.y_ticks}
    drawn = [float(y) for y in re.findall(r",([\d.]+)", chart.line)]
    assert drawn == pytest.approx([height["0.4"]] * 2, abs=0.06)


def test_curves_drawn_together_share_their_axes() -> None:
    higher = Curve([0.0, 2.0], [0.8, 0.8], [0.7, 0.7], [0.9, 0.9], (0.0, 2.0), 0.5, "x", "y", "title")
    chart = draw_together([curve(), higher])
    place = {tick.text: tick.place for tick in (*chart.y_ticks, *chart.x_ticks)}
    first, second = ([tuple(map(float, p.split(","))) for p in line.split()] for line in chart.lines)
    assert [y for _, y in first] == pytest.approx([place["0.4"]] * 2, abs=0.06)
    assert [y for _, y in second] == pytest.approx([place["0.8"]] * 2, abs=0.06)
    assert (first[-1][0], second[-1][0]) == pytest.approx((place["1"], place["2"]), abs=0.06)
    assert chart.marked == pytest.approx(place["0.5"], abs=0.06)


def forces(asked: float, from_probability: float) -> ForceCurve:
    """Forces 1/p^¼ that hold, up to any, from a probability on."""
    grid = probabilities(asked)
    smallest = np.where(grid >= from_probability, grid**-0.25, np.nan)
    return ForceCurve(grid, smallest, np.where(np.isnan(smallest), np.nan, np.inf))


@pytest.mark.parametrize("asked", [1e-12, 1e-3, 0.5])
@pytest.mark.parametrize("start", [0.0, 1e-4, 0.4, 1.0])
def test_forces_are_drawn_inside_of_the_picture(asked: float, start: float) -> None:
    chart = draw_forces(forces(asked, start), asked)
    drawn = [tuple(map(float, point.split(","))) for point in f"{chart.line} {chart.band}".split()]
    assert bool(drawn) == (start < 0.5)
    assert all(chart.left <= x <= chart.right and chart.top <= y <= chart.bottom for x, y in drawn)
    assert chart.left <= chart.marked <= chart.right
    assert (chart.marked_force is None) == (asked < start)
    assert (chart.without is None) == (start == 0.0)


def test_where_no_force_holds_ends_where_the_line_begins_and_what_was_asked_is_on_it() -> None:
    chart = draw_forces(forces(1e-3, 1e-4), 1e-3)
    points = [tuple(map(float, point.split(","))) for point in chart.line.split()]
    assert chart.without == pytest.approx((chart.left, points[0][0]), abs=0.06)
    assert chart.marked_force is not None
    assert min(abs(x - chart.marked) + abs(y - chart.marked_force) for x, y in points) < 0.12
    decade = {tick.text: tick.place for tick in chart.x_ticks}
    assert chart.marked == pytest.approx(decade["10⁻³"])
    assert list(decade) == ["10⁻⁶", "10⁻⁵", "10⁻⁴", "10⁻³", "10⁻²", "10⁻¹"]
