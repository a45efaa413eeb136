"""Kernels of smoothing: their transfer, their inverse, and when noise shows one."""

import math

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from slipcore.defaults import SMOOTHING
from slipcore.surface.smoothing import _size, bend_of_noise, kernel_width, transfer, unsmoothed

LEAST = 1e-8


def noise(shape: tuple[int, ...], width: float = 1.0, seed: int = 5) -> np.ndarray:
    fresh = np.random.default_rng(seed).standard_normal(shape)
    return np.asarray(1e-6 * gaussian_filter(fresh, (0.0, width, width, 0.0)))


def times(frames: int) -> np.ndarray:
    return np.arange(frames) / 30.0


def test_a_transfer_is_one_of_what_is_even_and_a_gaussian_of_waves() -> None:
    frequency = np.array([0.0, 0.5, 1.0, 2.0])
    np.testing.assert_array_equal(transfer(0.0, frequency), 1.0)
    for width in (0.8, 1.5):
        gaussian = np.exp(-0.5 * (width * frequency) ** 2)
        np.testing.assert_allclose(transfer(width, frequency), gaussian, rtol=0.0, atol=5e-3)  # for it is sampled
    narrow = math.exp(-0.5 / 0.2**2)
    expected = (1.0 + 2.0 * narrow * np.cos(frequency)) / (1.0 + 2.0 * narrow)
    np.testing.assert_allclose(transfer(0.2, frequency), expected, rtol=1e-12)  # three elements are reached


def test_white_noise_bends_by_six() -> None:
    """∫(2 − 2 cos ω)² over 6 ∫1 is (4 + 2)/6; of a narrow kernel a share g² of each wave is left."""
    assert bend_of_noise(0.0) == pytest.approx(1.0, rel=5e-3)
    frequency = np.linspace(0.0, np.pi, 20_001)
    power = transfer(0.7, frequency) ** 2
    expected = np.trapezoid((2.0 - 2.0 * np.cos(frequency)) ** 2 * power) / np.trapezoid(power) / 6.0
    assert bend_of_noise(0.7) == pytest.approx(expected, rel=5e-3)


@pytest.mark.parametrize(("frames", "side", "found"), [(12, 10, True), (11, 10, False), (12, 9, False)])
def test_a_kernel_is_read_from_enough_frames_of_enough_elements(frames: int, side: int, found: bool) -> None:
    assert (SMOOTHING.least_frames, SMOOTHING.least_elements) == (12, 64)
    width = kernel_width(times(frames), noise((frames, side, side, 3)), LEAST)
    assert (width > 0.0) == found
    assert not found or width == pytest.approx(1.0, rel=0.3)


def test_a_lattice_of_one_row_shows_no_kernel() -> None:
    assert kernel_width(times(30), noise((30, 1, 400, 3)), LEAST) == 0.0
    assert kernel_width(times(30), noise((30, 400, 1, 3)), LEAST) == 0.0


@pytest.mark.parametrize(("scale", "found"), [(0.9, False), (1.1, True)])
def test_noise_is_compared_with_the_least_as_three_frames_show_it(scale: float, found: bool) -> None:
    """What parts a frame from the middle of its neighbours has 1 + ½ times the variance."""
    field = noise((60, 16, 16, 3))
    deviation = float(np.median(_size(field)))
    assert (kernel_width(times(60), field, deviation / scale) > 0.0) == found


def test_motion_that_is_even_in_time_is_no_noise_whatever_the_frames_times() -> None:
    """Frames at uneven times: an even motion of any field leaves the kernel as it is."""
    time = np.cumsum(np.random.default_rng(6).uniform(0.5, 1.5, 60)) / 30.0
    field = noise((60, 16, 16, 3))
    motion = 1e-4 * np.random.default_rng(7).standard_normal((16, 16, 3))
    still = kernel_width(time, field, LEAST)
    moving = kernel_width(time, field + time[:, None, None, None] * motion, LEAST)
    assert moving == pytest.approx(still, rel=1e-6)
    assert still == pytest.approx(1.0, rel=0.15)


@pytest.mark.parametrize(("share", "found"), [(0.05, True), (0.2, False)])
def test_readings_that_are_held_back_show_rounding_and_no_kernel(share: float, found: bool) -> None:
    field = noise((60, 16, 16, 3))
    count = round(share * 256)
    field.reshape(60, 256, 3)[:, :count] = 0.0
    assert (kernel_width(times(60), field, LEAST) > 0.0) == found


@pytest.mark.parametrize("width", [0.0, 0.25, 2.5])
def test_noise_that_is_white_or_too_wide_shows_no_kernel(width: float) -> None:
    field = noise((60, 16, 16, 3), width)
    assert kernel_width(times(60), field, 1e-12) == 0.0


def test_a_size_is_the_deviation_about_what_all_have_in_common() -> None:
    field = noise((5, 40, 40, 3), 0.0)
    shifted = field + np.array([1.0, -2.0, 3.0])
    np.testing.assert_allclose(_size(shifted), _size(field), rtol=1e-6)
    np.testing.assert_allclose(_size(field), 1e-6, rtol=0.1)
    np.testing.assert_allclose(_size(3.0 * field), 3.0 * _size(field), rtol=1e-9)


@pytest.mark.parametrize(("n", "m"), [(12, 9), (9, 12)])
@pytest.mark.parametrize("left", [0.0, 1e-3, 0.1])
def test_a_wave_is_sharpened_by_wieners_gain(n: int, m: int, left: float) -> None:
    """Cosines that the transform knows: G of both directions, and G(1 + ε)/(G² + ε)."""
    i, j = np.meshgrid(np.arange(n), np.arange(m), indexing="ij")
    wave = np.cos(np.pi * 2 * (i + 0.5) / n) * np.cos(np.pi * 3 * (j + 0.5) / m)
    kept = float(transfer(0.8, np.array([2 * np.pi / n]))[0] * transfer(0.8, np.array([3 * np.pi / m]))[0])
    gain = kept * (1.0 + left) / (kept**2 + left)
    found = unsmoothed(np.stack([wave, 2.0 * wave], axis=-1), 0.8, left)
    np.testing.assert_allclose(found[..., 0], gain * wave, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(found[..., 1], 2.0 * gain * wave, rtol=0.0, atol=1e-12)
    even = np.full((n, m, 1), 4.0)
    np.testing.assert_allclose(unsmoothed(even, 0.8, left), even, rtol=1e-12)
