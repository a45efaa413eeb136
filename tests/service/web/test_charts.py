import re

import numpy as np
import pytest

from service.domain.planning.plan import ForceCurve
from service.web.charts import BOTTOM, HEIGHT, LEFT, RIGHT, TOP, WIDTH, Axis, Curve, draw, draw_together, points, ticks
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


@pytest.mark.parametrize(
    ("value", "place"), [(-3.0, 100.0), (-2.0, 100.0), (-1.0, 120.0), (1.0, 160.0), (3.0, 200.0), (4.0, 200.0)]
)
def test_an_axis_of_any_ends_has_its_values_evenly_between_its_places(value: float, place: float) -> None:
    assert Axis(-2.0, 3.0, 100.0, 200.0).place(value) == pytest.approx(place)
    assert Axis(-2.0, 3.0, 200.0, 100.0).place(value) == pytest.approx(300.0 - place)


def test_marks_of_an_axis_stand_at_round_values_with_a_true_minus() -> None:
    found = Axis(-0.25, 0.25, 0.0, 10.0).ticks()
    assert [tick.text for tick in found] == ["−0.2", "−0.1", "0", "0.1", "0.2"]
    assert [tick.place for tick in found] == pytest.approx([1.0, 3.0, 5.0, 7.0, 9.0])
    assert [tick.text for tick in Axis(0.0, 1.0, 0.0, 10.0).ticks(3)] == ["0", "0.5", "1"]


@pytest.mark.parametrize(
    ("most", "expected"),
    [(11, [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10]), (6, [0, 2, 4, 6, 8, 10]), (3, [0, 5, 10]), (1, [0, 10])],
)
def test_there_are_no_more_ticks_than_asked_for(most: int, expected: list[float]) -> None:
    assert ticks(0.0, 10.0, most) == expected


def test_points_of_lists_that_differ_in_length_are_none() -> None:
    axis = Axis(0.0, 1.0, 0.0, 10.0)
    assert points(axis, axis, [0.0, 0.5], [1.0, 0.25]) == "0.0,10.0 5.0,2.5"
    with pytest.raises(ValueError, match="shorter"):
        points(axis, axis, [0.0, 0.5], [1.0])


def test_a_band_goes_there_along_its_upper_edge_and_back_along_its_lower_one() -> None:
    three = Curve([0.0, 1.0, 2.0], [0.4] * 3, [0.1, 0.2, 0.3], [0.5, 0.6, 1.0], (0.5, 1.5), 1.0, "x", "y", "title")
    chart = draw(three)
    drawn = [tuple(map(float, point.split(","))) for point in chart.band.split()]
    across = [LEFT + (WIDTH - LEFT - RIGHT) * x / 2.0 for x in (0.0, 1.0, 2.0, 2.0, 1.0, 0.0)]
    heights = [HEIGHT - BOTTOM - (HEIGHT - TOP - BOTTOM) * y / 1.05 for y in (0.5, 0.6, 1.0, 0.3, 0.2, 0.1)]
    assert [x for x, _ in drawn] == pytest.approx(across, abs=0.06)
    assert [y for _, y in drawn] == pytest.approx(heights, abs=0.06)
    assert chart.seen == pytest.approx((0.75 * across[0] + 0.25 * across[2], 0.25 * across[0] + 0.75 * across[2]))
    assert chart.marked == pytest.approx(across[1])


def test_of_curves_drawn_together_the_first_one_s_words_and_mark_count() -> None:
    first = Curve([0.0, 1.0], [0.4] * 2, [0.3] * 2, [0.5] * 2, (0.2, 0.8), 0.25, "x", "y", "title")
    other = Curve([0.0, 1.0], [0.4] * 2, [0.3] * 2, [0.5] * 2, (0.2, 0.8), 0.75, "a", "b", "other")
    chart = draw_together([first, other])
    assert (chart.x_label, chart.y_label, chart.title) == ("x", "y", "title")
    assert chart.marked == pytest.approx(LEFT + 0.25 * (WIDTH - LEFT - RIGHT))


@pytest.mark.parametrize(("asked", "most"), [(1.0, 5.5), (10.0, 44.0), (0.0, 44.0)])
def test_the_axis_of_forces_reaches_a_tenth_beyond_the_largest_or_five_times_what_is_asked(
    asked: float, most: float
) -> None:
    grid = np.array([1e-6, 1e-3, 0.5])
    curve = ForceCurve(grid, np.array([40.0, asked, 0.5]), np.full(3, np.inf))
    chart = draw_forces(curve, 1e-3)
    assert chart.marked_force == pytest.approx(HEIGHT - BOTTOM - (HEIGHT - TOP - BOTTOM) * asked / most)
    assert len(chart.line.split()) == (2 if most < 40.0 else 3)
    assert len(chart.band.split()) == 2 * len(chart.line.split())
    assert chart.without is None
