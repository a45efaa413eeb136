"""The picture of how grasps differ from a model, number by number."""

from types import SimpleNamespace
from typing import Any

import pytest

from service.web.charts import BOTTOM, HEIGHT, LEFT, RIGHT, TOP, WIDTH
from service.web.grasp_effects import Differing, draw_effects


def grasp(value: float, low: float, high: float) -> Differing:
    effect: Any = SimpleNamespace(value=value, interval=(low, high))
    log: Any = None
    return Differing(log, effect)


def up(share: float) -> float:
    """Where a share of the picture's height stands, from the bottom."""
    return HEIGHT - BOTTOM - (HEIGHT - TOP - BOTTOM) * share


@pytest.mark.parametrize(
    ("low", "high", "is_certain"),
    [(0.1, 0.2, True), (-0.2, -0.1, True), (-0.1, 0.1, False), (0.0, 0.1, False), (-0.1, 0.0, False)],
)
def test_a_difference_is_certain_whose_interval_leaves_0_out(low: float, high: float, is_certain: bool) -> None:
    assert grasp(0.5 * (low + high), low, high).is_certain is is_certain


def test_grasps_stand_evenly_side_by_side_and_their_intervals_to_a_common_scale() -> None:
    chart = draw_effects([grasp(0.1, -0.1, 0.3), grasp(-0.2, -0.25, -0.15)])
    width = WIDTH - LEFT - RIGHT
    first, second = chart.whiskers
    assert (first.x, second.x) == pytest.approx((LEFT + 0.25 * width, LEFT + 0.75 * width))
    most = 0.315  # a twentieth beyond the farthest end

    def place(effect: float) -> float:
        return up(0.5 + 0.5 * effect / most)

    assert (first.y, first.low, first.high) == pytest.approx((place(0.1), place(-0.1), place(0.3)))
    assert (second.y, second.low, second.high) == pytest.approx((place(-0.2), place(-0.25), place(-0.15)))
    assert chart.zero == pytest.approx(up(0.5))
    assert {tick.text: tick.place for tick in chart.y_ticks}["20"] == pytest.approx(place(0.2))  # per cent
    assert [whisker.is_certain for whisker in chart.whiskers] == [False, True]


def test_grasps_that_hardly_differ_are_not_drawn_as_if_they_did() -> None:
    chart = draw_effects([grasp(0.0, -1e-6, 1e-6)])
    (only,) = chart.whiskers
    assert only.x == pytest.approx(LEFT + 0.5 * (WIDTH - LEFT - RIGHT))
    assert (only.low, only.high) == pytest.approx((up(0.5), up(0.5)), abs=0.2)  # of a scale of a tenth of a per cent
