"""Rates of the load, low-passed, against those of a load that grows evenly."""

import math
from inspect import unwrap

import numpy as np
import pytest

from slipcore.detection.filter.loading import Loading, low_pass, step_loading
from slipcore.detection.filter.pose import AnchorMotion

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
