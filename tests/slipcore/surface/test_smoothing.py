"""Fields that a sensor smooths: the kernel is read from their noise, and undone."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from service.slip_benchmark.faults import correlated, rounded, smoothed
from slipcore import GraspLog, SlipDetector, SlipHistory, detect_slip
from slipcore.defaults import SMOOTHING
from slipcore.surface import smoothing
from slipcore.surface.smoothing import bend_of_noise, kernel_width, transfer, unsmoothed

Scene = Callable[..., GraspLog]
Score = Callable[[GraspLog, SlipHistory], float]


def noise(frames: int, width: float = 0.0, seed: int = 1) -> np.ndarray:
    white = 1e-6 * np.random.default_rng(seed).standard_normal((frames, 20, 20, 3))
    return gaussian_filter(white, (0.0, width, width, 0.0), mode="reflect")


def test_the_transfer_is_what_the_kernel_leaves_of_a_cosine() -> None:
    wave = np.cos(np.pi * 3 * (np.arange(20) + 0.5) / 20)
    left = transfer(0.7, np.array([np.pi * 3 / 20]))
    np.testing.assert_allclose(
        gaussian_filter(wave, 0.7, mode="reflect"), left * wave, rtol=0.0, atol=1e-14
    )  # rounding


def test_noise_that_is_not_smoothed_bends_as_white_noise_does() -> None:
    assert bend_of_noise(0.0) == pytest.approx(1.0, rel=2e-3)  # the integral by 513 values
    assert bend_of_noise(0.3) > bend_of_noise(0.6) > bend_of_noise(1.2) > 0.0


@pytest.mark.parametrize("width", [0.5, 1.0, 1.4])
def test_the_kernel_is_read_from_noise(width: float) -> None:
    time = np.arange(60) / 30.0
    found = kernel_width(time, noise(60, width), 1e-8)
    assert found == pytest.approx(width, rel=0.05)  # medians over 60 frames; the edge


def test_nothing_is_read_where_noise_is_white_or_rounded_or_none(scene: Scene) -> None:
    log = scene("cond1", marker_noise=1e-6, force_noise=2e-3)
    for seen in (log, correlated(1e-5)(log, np.random.default_rng(1)), rounded(5e-6)(log, np.random.default_rng(1))):
        assert kernel_width(seen.time, seen.displacement, 1e-7) == 0.0
    still = scene("cond1")
    assert kernel_width(still.time, still.displacement, 1e-7) == 0.0
    assert kernel_width(log.time[:5], log.displacement[:5], 1e-7) == 0.0


def test_a_smoothed_field_comes_back() -> None:
    i, j = np.meshgrid(np.arange(20), np.arange(16), indexing="ij")
    field = np.exp(-((i - 9.0) ** 2 + (j - 8.0) ** 2) / 8.0)[None, ..., None]
    seen = gaussian_filter(field, (0.0, 1.0, 1.0, 0.0), mode="reflect")
    errors = [np.abs(unsmoothed(seen, 1.0, left) - field).max() for left in (1e-2, 1e-4, 1e-6)]
    assert errors[0] > 2.0 * errors[1] > 4.0 * errors[2]  # what is left out shrinks with its regularisation
    assert errors[2] < 1e-2 < np.abs(seen - field).max()
    np.testing.assert_allclose(unsmoothed(seen, 0.0, 1e-3), seen, rtol=0.0, atol=1e-15)  # rounding of the transform


def test_slip_is_found_through_smoothing_and_the_history_says_so(scene: Scene, f1_score: Score) -> None:
    log = smoothed(1.0)(scene("cond1", marker_noise=1e-6, force_noise=2e-3), np.random.default_rng(1))
    history = detect_slip(log)
    assert "smoothed" in [finding.name for finding in history.findings]
    blind = detect_slip(log, marker_kernel=0.0)
    assert f1_score(log, history) > f1_score(log, blind) + 0.05


def test_a_stream_that_is_told_of_the_kernel_finds_what_the_whole_log_does(scene: Scene) -> None:
    log = replace(smoothed(1.0)(scene("ring", marker_noise=1e-6), np.random.default_rng(1)), force=None)
    kernel = {"marker_kernel": np.sqrt(log.element_area)}
    detector = SlipDetector(log.position, log.element_area, **kernel)
    slip = [detector.step(frame.time, frame.displacement, normal=frame.normal).slip for frame in log.frames()]
    np.testing.assert_array_equal(slip, detect_slip(replace(log, object_pose=None), **kernel).slip)


@pytest.mark.parametrize("width", [0.6, 1.2])
def test_a_few_rows_of_a_dense_sensor_show_the_kernel_as_all_of_them_do(
    width: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    time, shape = np.arange(20) / 30.0, (20, 100, 120, 3)
    field = gaussian_filter(np.random.default_rng(2).standard_normal(shape), (0.0, width, width, 0.0), mode="reflect")
    field[:, 40:80, 30:90] += 50.0 * (time**2)[:, None, None, None]  # a contact moves
    found = kernel_width(time, field, 0.0)
    monkeypatch.setattr(smoothing, "SMOOTHING", replace(SMOOTHING, least_elements=shape[1] * shape[2] // 64))
    by_all = kernel_width(time, field, 0.0)
    assert found != by_all  # few are looked at
    assert found == pytest.approx(by_all, rel=0.01)  # five deviations of medians of 4,000 elements in 18 frames
