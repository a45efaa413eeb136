import numpy as np
import pytest

from slipcore.detection.shared.observe import step_noise
from slipcore.noise import estimate_noise, ranked


def smooth(time: np.ndarray) -> np.ndarray:
    """[t, 2, 400] m: the lattice moves by 0.5 mm in 2 s, each marker in its own way."""
    own = np.linspace(0.5, 1.0, 400)
    return 5e-4 * np.sin(0.7 * time)[:, None, None] * np.stack([own, -own])


@pytest.mark.parametrize(("sigma", "uneven"), [(1e-7, False), (1e-6, False), (1e-5, False), (1e-6, True), (1e-5, True)])
def test_noise_is_found_under_motion_and_uneven_frames(sigma: float, uneven: bool) -> None:
    rng = np.random.default_rng(9)
    time = np.cumsum(rng.choice([1, 1, 1, 2, 5], 90)) / 60.0 if uneven else np.arange(90) / 30.0
    values = smooth(time) + sigma * rng.standard_normal((90, 2, 400))
    # The median of 31 estimates from 800 values each has a standard error of 1 %; curvature of the motion adds 1 %.
    assert estimate_noise(time, values) == pytest.approx(sigma, rel=0.05)


def test_steady_motion_through_uneven_frames_is_no_noise() -> None:
    rng = np.random.default_rng(12)
    time = np.cumsum(rng.choice([1, 2, 5], 90)) / 60.0
    speed = 5e-3 * np.linspace(-1.0, 1.0, 400)
    values = time[:, None, None] * speed + 1e-6 * rng.standard_normal((90, 2, 400))
    assert estimate_noise(time, values) == pytest.approx(1e-6, rel=0.05)


def test_a_burst_of_motion_and_a_minority_that_moves_do_not_count() -> None:
    rng = np.random.default_rng(10)
    values = 1e-6 * rng.standard_normal((60, 2, 400))
    values[30:33] += 1e-3 * rng.standard_normal((3, 2, 400))
    values[:, :, :120] += 1e-4 * rng.standard_normal((60, 2, 120))
    assert estimate_noise(np.arange(60) / 30.0, values) == pytest.approx(1e-6, rel=0.6)  # 30 % contamination of a MAD


@pytest.mark.parametrize("frames", [1, 2])
def test_fewer_than_three_frames_say_nothing(frames: int) -> None:
    assert np.isnan(estimate_noise(np.arange(float(frames)), np.zeros((frames, 2, 9))))


def test_a_frozen_sensor_says_nothing_of_its_noise() -> None:
    assert np.isnan(estimate_noise(np.arange(20.0), np.ones((20, 2, 9))))


def test_markers_behind_a_dead_zone_are_left_out() -> None:
    values = 1e-6 * np.random.default_rng(11).standard_normal((60, 2, 400))
    values[:, :, :300] = 0.0
    assert estimate_noise(np.arange(60) / 30.0, values) == pytest.approx(1e-6, rel=0.05)


def by_numpy(time: np.ndarray, values: np.ndarray) -> float:
    """The estimate written out with numpy's own medians."""
    found = []
    for (t0, t1, t2), (first, middle, last) in zip(
        zip(time, time[1:], time[2:], strict=False), zip(values, values[1:], values[2:], strict=False), strict=True
    ):
        share = (t1 - t0) / (t2 - t0)
        residual = middle - ((1.0 - share) * first + share * last)
        upper = residual.shape[1] // 2
        about = np.sort(residual)[:, upper : upper + 1]
        deviation = np.sort(np.abs(residual - about))[:, upper]
        found.append(1.4826022185056018 * np.sqrt((deviation**2).mean() / (1.0 + (1.0 - share) ** 2 + share**2)))
    recent = np.sort(found[-31:])
    return float(recent[len(recent) // 2] * (1.0 + 1.0 / len(recent) - 1.0 / 31))


@pytest.mark.parametrize("count", [5, 64, 400])
def test_compiled_medians_are_those_of_numpy(count: int) -> None:
    rng = np.random.default_rng(13)
    time = np.cumsum(rng.choice([1, 2, 5], 60)) / 60.0
    values = rng.standard_normal((60, 2, count)) * rng.choice([1.0, 5.0], (60, 1, 1))
    np.testing.assert_allclose(estimate_noise(time, values), by_numpy(time, values), rtol=1e-13)  # rounding


def test_an_online_estimate_looks_at_few_elements_and_skips_repeated_frames() -> None:
    rng = np.random.default_rng(14)
    frames = 1e-6 * rng.standard_normal((60, 20, 20, 3))
    noise, series = np.zeros((9, 64)), np.empty((2, 64))
    for k, frame in enumerate(np.repeat(frames, 2, axis=0)):
        after = np.full_like(noise, np.nan)
        marker, pressing = step_noise(noise, k / 60.0, frame, -frame[..., 2].copy(), after, series)
        noise = after
    assert marker == pytest.approx(1e-6, rel=0.1)  # 64 of 400 elements: 2 %, and uneven thirds of a second
    assert pressing == pytest.approx(1e-6, rel=0.1)
    assert noise[2, 2] == 60.0


@pytest.mark.parametrize("count", [1, 2, 3, 5, 9, 64, 290])
def test_selection_finds_the_value_that_so_many_precede_in_order(count: int) -> None:
    rng = np.random.default_rng(count)
    for values in (rng.standard_normal(count), np.round(rng.standard_normal(count)), np.arange(1.0 * count)):
        for rank in {0, count // 4, count // 2, count - 1}:
            assert ranked(values[::-1].copy(), rank) == np.sort(values)[rank]
