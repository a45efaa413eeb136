"""Noise that lasts from frame to frame."""

import numpy as np
import pytest
from scipy.signal import lfilter

from benchmarks.detector.bounds import lasting
from slipcore.frames import FloatArray
from slipcore.noise_memory import WHITE, NoiseMemory, _variances, fit_memory, lasting_noise_of

TIME = np.arange(300) / 30.0
MEMORY = float(np.exp(-0.1))
"""Of a filter with a time constant of ten frames."""


def series(noise: float, seed: int, count: int = 64) -> tuple[FloatArray, FloatArray]:
    """White noise and noise that lasts, of the same size, [t, 3, k]."""
    rng = np.random.default_rng(seed)
    return noise * rng.standard_normal((300, 3, count)), noise * lasting((300, 3, count), rng)


def test_variances_are_not_negative() -> None:
    terms = np.stack([np.ones(9), 1.0 - 0.5 ** np.arange(1, 10)], axis=1)
    found, misfit = _variances(terms @ [3.0, 4.0], terms)
    np.testing.assert_allclose(found, [3.0, 4.0], rtol=1e-9)
    assert misfit == pytest.approx(0.0, abs=1e-9)
    found, misfit = _variances(terms @ [8.0, -2.0], terms)
    assert (found[1], found[0] > 3.0, misfit > 0.0) == (0.0, True, True)


def test_the_memory_of_noise_is_found_below_the_longest() -> None:
    lag = np.arange(1, 20)

    def terms(memory: float) -> FloatArray:
        return np.stack([np.ones(len(lag)), 1.0 - memory**lag], axis=1)

    for memory in (0.8, 0.99):
        found = fit_memory(terms(memory) @ [1.0, 2.0], terms, longest=0.999)
        assert found == pytest.approx((1.0, 2.0, memory), rel=1e-2)
    assert fit_memory(terms(0.9) @ [0.0, 2.0], terms, longest=0.7).memory == pytest.approx(0.7, rel=1e-3)


def test_noise_that_lasts_for_many_frames_of_a_fast_log_is_known() -> None:
    """For 0.1 s at 1 kHz: it had been taken for half as large, and a fifth as long."""
    memory, time = float(np.exp(-0.01)), np.arange(2000) / 1000.0
    rng = np.random.default_rng(1)
    noise = lfilter([5e-3 * np.sqrt(1.0 - memory**2)], [1.0, -memory], rng.standard_normal((3000, 3, 16)), axis=0)
    shown = np.sqrt((1.5 - 2.0 * memory + 0.5 * memory**2) / 1.5)
    found = lasting_noise_of(time, noise[1000:], 0.5, 1e-4)
    np.testing.assert_allclose(found, [1.0 / shown, (1.0 + memory) / (1.0 - memory)], rtol=0.3)


def test_frames_that_know_no_more_than_one_are_the_integral_of_the_correlation() -> None:
    """(1 + φ)/(1 − φ) of a first-order process alone."""
    assert NoiseMemory(0.0, 2.0, 0.9).frames == pytest.approx(19.0)
    assert NoiseMemory(2.0, 2.0, 0.9).frames == pytest.approx(10.0)
    assert NoiseMemory(2.0, 0.0, 0.9).frames == 1.0


@pytest.mark.parametrize("count", [9, 100])
def test_lasting_noise_is_larger_than_three_frames_show(count: int) -> None:
    """By √(3/2) over the square root of 3/2 − 2φ + φ²/2, for (1 + φ)/(1 − φ) frames."""
    shown = np.sqrt((1.5 - 2.0 * MEMORY + 0.5 * MEMORY**2) / 1.5)
    found = np.median([lasting_noise_of(TIME, series(5e-3, seed, count)[1], 0.5, 1e-4) for seed in range(9)], axis=0)
    np.testing.assert_allclose(found, [1.0 / shown, (1.0 + MEMORY) / (1.0 - MEMORY)], rtol=0.3)


def test_white_noise_under_loads_that_change_does_not_last() -> None:
    loads = 0.2 * np.sin(0.4 * np.pi * TIME)[:, None, None] * np.linspace(0.0, 1.0, 64)
    for seed in range(9):
        assert lasting_noise_of(TIME, loads + series(1e-3, seed)[0], 0.5, 1e-4) == WHITE


@pytest.mark.parametrize("hertz", [1.0, 2.0, 4.0])
def test_no_noise_is_less_than_three_frames_show(hertz: float) -> None:
    """Of loads that bend from frame to frame by more than their noise."""
    loads = 0.2 * np.sin(2.0 * np.pi * hertz * TIME)[:, None, None] * np.linspace(0.0, 1.0, 64)
    assert lasting_noise_of(TIME, loads + series(1e-3, 0)[0], 0.5, 1e-4).gain >= 1.0


def test_little_noise_few_frames_and_few_series_show_nothing_of_how_it_lasts() -> None:
    noise = series(5e-3, 0)[1]
    assert lasting_noise_of(TIME, 1e-3 * noise, 0.5, 1e-4) == WHITE
    assert lasting_noise_of(TIME[:2], noise[:2], 0.5, 1e-4) == WHITE
    assert lasting_noise_of(TIME[:1], noise[:1], 0.5, 1e-4) == WHITE
    assert lasting_noise_of(TIME, noise[..., :3], 0.5, 1e-4) == WHITE
