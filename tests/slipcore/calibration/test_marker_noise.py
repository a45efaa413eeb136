"""Noise of markers by its variogram."""

import math
from dataclasses import replace

import numpy as np
import pytest

from slipcore.calibration.marker_noise import _bounded, _change, _fit, _mean_squares, marker_noise
from slipcore.calibration.press import PressLog, find_press
from slipcore.frames import FloatArray
from tests.slipcore.calibration.straight_press import LOAD, shares, straight

LAGS = np.arange(1, 31)


def noisy(motion: FloatArray, load: FloatArray = LOAD) -> PressLog:
    """Markers that move, beside the press, by ``motion`` [t, 8, 8, 2] m."""
    log = straight(load=load)
    moved = log.displacement + np.concatenate([motion, np.zeros_like(motion[..., :1])], axis=-1)
    return find_press(replace(log, displacement=moved))


@pytest.mark.parametrize(("white", "lasting", "memory"), [(1.0, 2.0, 0.8), (0.5, 1.0, 0.43), (2.0, 0.0, 0.0)])
def test_an_exact_variogram_gives_its_process(white: float, lasting: float, memory: float) -> None:
    variogram = 2.0 * white**2 + 2.0 * lasting**2 * (1.0 - memory**LAGS)
    deviation, correlation = _fit(variogram)
    variance = white**2 + lasting**2
    assert deviation == pytest.approx(math.sqrt(variance), rel=1e-3)  # the memory's search ends at 1e-5 of it
    assert correlation == pytest.approx(memory * lasting**2 / variance, abs=2e-3)


def test_no_noise_remembers_nothing() -> None:
    assert _fit(np.zeros(5)) == (0.0, 0.0)


def test_changes_are_counted_between_free_frames_alone() -> None:
    plane = np.array([[[0.0, 0.0]], [[1.0, 2.0]], [[7.0, 7.0]], [[3.0, 2.0]], [[3.0, 4.0]]])
    free = np.array([True, True, False, True, True])
    total, pairs = _change(plane, free, 1)
    assert (total.tolist(), pairs) == ([0.5 * (1.0 + 4.0 + 4.0)], 2)
    total, pairs = _change(plane, free, 3)
    assert (total.tolist(), pairs) == ([0.5 * (9.0 + 4.0 + 4.0 + 4.0)], 2)


def test_motion_in_common_is_no_noise() -> None:
    rng = np.random.default_rng(2)
    own = 1e-6 * rng.standard_normal((len(LOAD), 8, 8, 2))
    common = 1e-4 * rng.standard_normal((len(LOAD), 1, 1, 2))
    alone, together = (_mean_squares([noisy(motion)]) for motion in (own, own + common))
    np.testing.assert_allclose(together, alone, rtol=1e-6, err_msg="rounding")
    assert alone.shape == (10, 64)  # of 11 free frames on each side


def test_white_noise_is_found_with_an_interval_that_holds_it() -> None:
    load = np.r_[np.zeros(200), LOAD[12:-12]]
    motion = 3e-6 * np.random.default_rng(4).standard_normal((len(load), 8, 8, 2))
    noise, memory = marker_noise([noisy(motion, load)])
    assert noise.low < 3e-6 < noise.high
    assert noise.high - noise.low < 0.2e-6
    assert noise.value == pytest.approx(3e-6, rel=0.015)  # three standard errors
    assert memory.low <= 0.02
    assert (noise.unit, memory.unit) == ("m", "-")


def test_what_the_mean_takes_off_is_made_up_for() -> None:
    """Of 16 elements it holds a sixteenth of their own noise: 3 % of its deviation, ten standard errors here."""
    motion = 3e-6 * np.random.default_rng(6).standard_normal((4000, 4, 4, 2))
    load = np.r_[np.zeros(3990), np.linspace(0.1, 1.0, 10)]
    log = straight(load=load, share=shares(1e-3, (4, 4)))
    moved = log.displacement + np.concatenate([motion, np.zeros_like(motion[..., :1])], axis=-1)
    noise, _ = marker_noise([find_press(replace(log, displacement=moved))])
    assert noise.value == pytest.approx(3e-6, rel=0.01)


def test_presses_are_joined_by_their_pairs() -> None:
    rng = np.random.default_rng(5)
    first, second = (noisy(size * rng.standard_normal((len(LOAD), 8, 8, 2))) for size in (1e-6, 3e-6))
    both = _mean_squares([first, second])
    np.testing.assert_allclose(both, 0.5 * (_mean_squares([first]) + _mean_squares([second])), rtol=1e-9)  # rounding


@pytest.mark.parametrize(("value", "half", "low", "high"), [(0.5, 0.2, 0.3, 0.7), (0.1, 0.2, 0.0, 0.3)])
def test_an_interval_stays_where_its_quantity_can_be(value: float, half: float, low: float, high: float) -> None:
    found = _bounded(("x", "-"), value, half, 1.0)
    assert (found.value, found.low, found.high) == pytest.approx((value, low, high))
    assert _bounded(("x", "-"), 0.9, 0.2, 1.0).high == 1.0


def test_few_free_frames_and_markers_at_rest_tell_no_noise() -> None:
    still = np.zeros((len(LOAD), 8, 8, 2))
    assert "rounded" in str(marker_noise([noisy(still)])[0].not_identified)
    short = LOAD[3:26]
    told = marker_noise([noisy(still[: len(short)], short)])
    assert ["fewer than 10 frames" in str(each.not_identified) for each in told] == [True, True]
