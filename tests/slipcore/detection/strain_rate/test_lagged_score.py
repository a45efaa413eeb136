import numpy as np

from slipcore.detection.strain_rate.lagged_score import init_lagged_score, step_lagged_score


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
