"""Rates of the load, low-passed, against those of a load that grows evenly."""

import math
from inspect import unwrap

import numpy as np
import pytest

from slipcore.defaults import FilterOptions
from slipcore.detection.filter.loading import Loading, low_pass, restick_by_depth, restick_by_force, step_loading
from slipcore.detection.filter.pose import AnchorMotion
from slipcore.detection.filter.tuning import Tuning, settings_of

INTERVAL, GAIN, STEPS = 0.02, 0.25, 3
X, Y = 4e-3 * np.array([1.0, -1.0, -1.0, 1.0]), 3e-3 * np.array([1.0, 1.0, -1.0, -1.0])
"""Corners of a rectangle, all 5 mm from its middle."""


def grown(force: np.ndarray) -> Loading:
    """After some steps of the same growth: the object moves by 5 µm and sinks in by 2 µm in each."""
    motion = AnchorMotion(np.full(4, 3e-6), np.full(4, -4e-6), np.zeros(4))
    loading = Loading(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    for _ in range(STEPS):
        loading = unwrap(step_loading)(loading, (X + 0.1, Y), motion, np.full(4, 2e-6), force, INTERVAL, GAIN)
    return loading


def test_rates_approach_those_of_an_even_growth_step_by_step() -> None:
    """Forces of 0.3 N about the middle: M/lever is their sum; beside them 0.1 N each along x, and 0.5 N inwards."""
    around = 0.3 / 5e-3 * np.array([-Y, X, np.zeros(4)])
    force = around + np.array([0.1, 0.0, -0.5])[:, None]
    reached = (1.0 - (1.0 - GAIN) ** STEPS) / INTERVAL
    np.testing.assert_allclose(grown(force), reached * np.array([2e-6, 5e-6, 2.0, 0.4, 0.0, 1.2]), rtol=1e-9, atol=1e-9)


def test_without_forces_only_motion_has_rates() -> None:
    assert grown(np.empty((3, 0)))[2:] == (0.0, 0.0, 0.0, 0.0)


@pytest.mark.parametrize("time_constant", [0.05, 0.4])
def test_a_step_is_low_passed_as_an_exponential_of_time_whatever_the_frame_rate(time_constant: float) -> None:
    for frames in (1, 2, 10):
        left = (1.0 - low_pass(0.1 / frames, time_constant)) ** frames
        assert left == pytest.approx(math.exp(-0.1 / time_constant), rel=1e-12)


def test_without_a_time_constant_the_newest_value_stands_alone() -> None:
    assert low_pass(0.1, 0.0) == 1.0


TUNING = Tuning(*settings_of(FilterOptions()))._replace(
    pressing_force_floor=0.5, pressing_force_deviations=4.0, pressing_floor=1e-6, pressing_deviations=3.0,
    pressing_slope=2.0, stiffness_ratio=0.5,
)  # fmt: skip


@pytest.mark.parametrize(
    ("normal", "sideways", "resticks"), [(3.9, 0.0, False), (4.1, 0.0, True), (4.1, 1.2, True), (4.1, 1.3, False)]
)
@pytest.mark.parametrize("along", ["force_x", "force_y", "twist"])
def test_all_sticks_under_a_force_that_grows_beyond_noise_and_faster_than_sideways(
    along: str, normal: float, sideways: float, resticks: bool
) -> None:
    """Noise of √3/10 N in 0.1 s is √3 N/s, of which a low-pass of 0.5 leaves √3 · √(1/3) · 0.5 = 0.5 N/s, beside a
    floor of as much; four of these; a slope of 0.3.
    """
    loading = Loading(0.0, 0.0, normal, 0.0, 0.0, 0.0)._replace(**{along: sideways})
    assert unwrap(restick_by_force)(loading, 0.1 * math.sqrt(3.0), 0.1, 0.5, 0.3, TUNING) == resticks


@pytest.mark.parametrize(
    ("depth", "motion", "resticks"),
    [(5.9e-6, 0.0, False), (6.1e-6, 0.0, True), (6.1e-6, 24e-6, True), (6.1e-6, 25e-6, False)],
)
def test_all_sticks_under_an_indentation_that_grows_beyond_noise_and_faster_than_the_object_moves(
    depth: float, motion: float, resticks: bool
) -> None:
    """Of two elements to 0.2 µm each, in 0.1 s through a low-pass of 0.5: 1 µm/s, and 1 µm/s; three of these; half of
    the motion against twice the depth.
    """
    loading = Loading(depth, motion, 0.0, 0.0, 0.0, 0.0)
    assert unwrap(restick_by_depth)(loading, 2, (0.2e-6) ** 2, 0.1, 0.5, TUNING) == resticks
