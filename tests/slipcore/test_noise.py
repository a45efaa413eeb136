import numpy as np
import pytest

from slipcore.noise import NOTHING_SEEN, estimate_noise, step_noise


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


def test_a_step_leaves_the_state_before_it_alone() -> None:
    state = step_noise(NOTHING_SEEN, 0.0, np.zeros((2, 9)))
    step_noise(state, 1.0, np.ones((2, 9)))
    assert len(state.before) == 1
    assert NOTHING_SEEN.before == ()
