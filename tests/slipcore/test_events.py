import numpy as np
import pytest

from slipcore.events import init_lagged_score, init_score, step_lagged_score, step_score

SETTINGS = {"time_constant": 10.0, "threshold": 3.0, "influence": 0.5}


def run(signal: np.ndarray, interval: float, floor: float = 0.1) -> np.ndarray:
    state, events = init_score(()), []
    for value in signal:
        state, event = step_score(state, np.asarray(value), interval, floor, **SETTINGS)
        events.append(int(event))
    return np.array(events)


def test_a_spike_up_and_a_spike_down_are_events_and_a_quiet_signal_has_none() -> None:
    signal = np.zeros(60)
    signal[20], signal[40] = 1.0, -1.0
    events = run(signal, 1 / 30)
    assert list(np.flatnonzero(events)) == [20, 40]
    assert (events[20], events[40]) == (1, -1)


def test_a_constant_signal_below_the_floor_is_never_an_event() -> None:
    assert not run(np.full(100, 0.29), 1 / 30).any()


def test_the_threshold_counts_standard_deviations_above_the_floor() -> None:
    noisy = np.random.default_rng(3).standard_normal(20_000)
    events = run(noisy, 0.01, floor=1e-6)
    assert 0.0005 < np.count_nonzero(events[2000:]) / 18_000 < 0.01  # 0.0027 for a normal distribution and a known σ


def test_the_running_mean_and_variance_forget_with_their_time_constant() -> None:
    state, _ = step_score(init_score(()), np.asarray(0.2), 10.0 * np.log(2.0), 1.0, **SETTINGS)
    assert state.mean == pytest.approx(0.1, rel=1e-14)
    assert state.variance == pytest.approx(0.5 * 0.5 * 0.2**2, rel=1e-14)


def test_what_is_remembered_depends_on_the_time_passed_not_on_the_number_of_frames() -> None:
    coarse = fine = init_score(())
    for _ in range(10):
        coarse, _ = step_score(coarse, np.asarray(0.2), 0.4, 1.0, **SETTINGS)
    for _ in range(40):
        fine, _ = step_score(fine, np.asarray(0.2), 0.1, 1.0, **SETTINGS)
    assert fine.mean == pytest.approx(coarse.mean, rel=1e-12)  # exact for a constant signal
    assert fine.variance == pytest.approx(coarse.variance, rel=1e-12)


def test_a_huge_gap_forgets_everything_and_stays_finite() -> None:
    state = init_score(())
    for value in (5.0, -3.0, 2.0):
        state, _ = step_score(state, np.asarray(value), 0.03, 1e3, **SETTINGS)
    state, _ = step_score(state, np.asarray(0.7), 1e12, 1e3, **SETTINGS)
    assert state.mean == pytest.approx(0.7)
    assert state.variance == pytest.approx(0.0)


def test_an_extreme_value_is_learnt_from_with_its_influence_only() -> None:
    state, event = step_score(init_score(()), np.asarray(1.0), 0.1, 0.1, **SETTINGS)
    assert event == 1
    assert state.mean == pytest.approx(-0.5 * np.expm1(-0.01), rel=1e-12)


def van_brakel(values: np.ndarray, lag: int, threshold: float, influence: float) -> np.ndarray:
    """The algorithm as its author prints it, for one series."""
    signals, filtered = np.zeros(len(values), int), list(values[:lag])
    for i in range(lag, len(values)):
        mean, std = np.mean(filtered[i - lag : i]), np.std(filtered[i - lag : i])
        if abs(values[i] - mean) > threshold * std:
            signals[i] = 1 if values[i] > mean else -1
            filtered.append(influence * values[i] + (1 - influence) * filtered[i - 1])
        else:
            filtered.append(values[i])
    return signals


def test_the_lagged_score_is_van_brakels_algorithm() -> None:
    rng = np.random.default_rng(8)
    values = rng.standard_normal((300, 4))
    values[rng.random(values.shape) < 0.05] *= 6.0
    state, events = init_lagged_score((4,), 12), []
    for row in values:
        state, event = step_lagged_score(state, row, 0.0, threshold=2.5, influence=0.3)
        events.append(event)
    for column in range(4):
        np.testing.assert_array_equal(np.array(events)[:, column], van_brakel(values[:, column], 12, 2.5, 0.3))
    assert np.count_nonzero(events) > 20


def test_the_lagged_score_does_not_write_to_its_state() -> None:
    state = init_lagged_score((2,), 3)
    step_lagged_score(state, np.ones(2), 0.0, threshold=3.0, influence=0.5)
    assert not state.filtered.any()
    assert state.seen == 0
