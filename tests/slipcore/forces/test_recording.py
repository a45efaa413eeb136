"""What markers show, as rows of data: order, signs, and what counts as motion."""

import numpy as np
import pytest

from slipcore.forces.recording import axes_seen, least_power, moved, rows, seen_along

MOVED = np.arange(1.0, 13.0).reshape(1, 2, 2, 3)


def test_data_go_axis_by_axis_with_z_into_the_gel() -> None:
    seen = np.ones(MOVED.shape, bool)
    seen[0, 0, 1, 2] = False
    data, known = rows(MOVED, seen, (0, 1, 2))
    assert data.tolist() == [[1.0, 4.0, 7.0, 10.0, 2.0, 5.0, 8.0, 11.0, -3.0, -6.0, -9.0, -12.0]]
    assert np.flatnonzero(~known[0]).tolist() == [9]
    assert rows(MOVED, seen, (0, 1))[0].tolist() == [[1.0, 4.0, 7.0, 10.0, 2.0, 5.0, 8.0, 11.0]]


def test_depth_is_seen_where_z_ever_changes() -> None:
    assert axes_seen(MOVED) == (0, 1, 2)
    assert axes_seen(MOVED * [1.0, 1.0, 0.0]) == (0, 1)


def test_a_marker_at_the_end_of_its_range_or_not_observed_is_not_seen() -> None:
    at_end = np.zeros(MOVED.shape, bool)
    at_end[0, 0, 0, 1] = True
    assert seen_along(None, at_end)[0, 0, 0].tolist() == [True, False, True]
    seen = seen_along(np.array([[[True, True], [False, True]]]), at_end)
    assert seen.sum() == 12 - 1 - 3


@pytest.mark.parametrize(("count", "level"), [(2, 5.0), (200, 0.5)])
def test_markers_move_above_five_deviations_of_the_mean_square_of_noise(count: int, level: float) -> None:
    assert least_power(count) == pytest.approx(level)
    seen = np.ones((1, count), bool)
    for above, is_moved in ((0.99, False), (1.01, True)):
        data = np.full((1, count), 3.0 * np.sqrt(1.0 + above * level))
        assert moved(data, seen, 3.0).tolist() == [is_moved]
    assert not moved(np.full((1, count), 1e3), ~seen, 3.0).any()
