import re

import pytest

from service.web.charts import HEIGHT, WIDTH, Curve, draw, ticks


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
