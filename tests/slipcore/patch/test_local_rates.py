"""Rates over a moving window, against least squares of each window by itself."""

import numpy as np
import pytest

from slipcore.patch.local_rates import local_rates, moving_mean

TIME = np.cumsum(np.random.default_rng(3).uniform(0.02, 0.08, 40)) + 1.7e9
WINDOW = 0.5
ALL = np.array([0, 40])
"""One patch has all frames."""


def window(k: int) -> np.ndarray:
    """Frames within half a window of frame k."""
    return np.flatnonzero(np.abs(TIME - TIME[k]) <= 0.5 * WINDOW)


def test_a_line_has_its_slope_at_uneven_times_and_no_error() -> None:
    slope, error = local_rates(TIME, np.stack([3.0 * (TIME - 1.7e9) - 7.0, np.full(40, 2.0)], axis=-1), ALL, WINDOW)
    np.testing.assert_allclose(slope, np.broadcast_to([3.0, 0.0], slope.shape), atol=1e-5)
    np.testing.assert_allclose(error, 0.0, atol=1e-4)


def test_slope_and_error_are_those_of_least_squares() -> None:
    values = np.random.default_rng(4).standard_normal((40, 2))
    slope, error = local_rates(TIME, values, ALL, WINDOW)
    for k in range(40):
        near = window(k)
        x = np.column_stack([np.ones(len(near)), TIME[near] - TIME[k]])
        fit, rest, *_ = np.linalg.lstsq(x, values[near], rcond=None)
        variance = rest / (len(near) - 2) * np.linalg.inv(x.T @ x)[1, 1]
        np.testing.assert_allclose(slope[k], fit[1], rtol=1e-4, atol=1e-4)
        np.testing.assert_allclose(error[k], np.sqrt(variance), rtol=1e-4)


def test_what_is_not_known_is_left_out_and_too_little_gives_no_rate() -> None:
    values = np.random.default_rng(5).standard_normal((40, 1))
    values[10:31] = np.nan
    slope, error = local_rates(TIME, values, ALL, WINDOW)
    assert np.isnan(slope[10:31]).all()
    assert np.isnan(error[10:31]).all()
    near = window(8)[window(8) < 10]
    assert slope[8, 0] == pytest.approx(np.polyfit(TIME[near] - TIME[8], values[near, 0], 1)[0], rel=1e-4)
    few = np.full((40, 1), np.nan)
    few[[5, 6, 7]] = 1.0
    assert np.isnan(local_rates(TIME, few, ALL, WINDOW)[0]).all()


def test_a_moving_mean_is_that_of_what_each_window_knows() -> None:
    values = np.random.default_rng(6).standard_normal(40)
    values[[3, 4, 20]] = np.nan
    expected = [np.nanmean(values[window(k)]) for k in range(40)]
    np.testing.assert_allclose(moving_mean(TIME, values, ALL, WINDOW)[0], expected, rtol=1e-9, atol=1e-12)
    assert np.isnan(moving_mean(TIME, np.full(40, np.nan), ALL, WINDOW)[0]).all()


@pytest.mark.parametrize("frames", [1_000, 1_000_000])
def test_a_rate_in_a_log_of_nine_hours_is_as_right_as_in_one_of_half_a_minute(frames: int) -> None:
    """A micrometre that comes and goes on a millimetre that drifts, at 30 frames a second."""
    time = np.arange(frames) / 30.0
    values = 1e-6 * np.sin(0.7 * time) + 1e-3 * np.sin(1e-4 * time)
    slope, _ = local_rates(time, values[:, None], np.array([0, frames]), WINDOW)
    expected = 0.7e-6 * np.cos(0.7 * time) + 1e-7 * np.cos(1e-4 * time)
    inner = slice(8, -8)  # at the ends windows have one side only
    np.testing.assert_allclose(slope[inner, 0], expected[inner], rtol=0, atol=3e-9, err_msg="curvature in a window")
    mean, _ = moving_mean(time, values, np.array([0, frames]), WINDOW)
    np.testing.assert_allclose(mean[inner], values[inner], rtol=0, atol=6e-9, err_msg="curvature in a window")


def test_no_window_reaches_into_another_patch() -> None:
    values, middle = np.random.default_rng(7).standard_normal((40, 1)), 17
    together = (
        *local_rates(TIME, values, np.array([0, middle, 40]), WINDOW),
        moving_mean(TIME, values[:, 0], np.array([0, middle, 40]), WINDOW)[0],
    )
    for part in (slice(middle), slice(middle, None)):
        alone = np.array([0, len(TIME[part])])
        slope, error = local_rates(TIME[part], values[part], alone, WINDOW)
        mean, _ = moving_mean(TIME[part], values[part, 0], alone, WINDOW)
        for seen, expected in zip(together, (slope, error, mean), strict=True):
            np.testing.assert_array_equal(seen[part], expected)
