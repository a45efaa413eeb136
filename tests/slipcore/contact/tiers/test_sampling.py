"""From a solver's grid to a sensor's points, counted by hand."""

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from slipcore.contact.defaults import ACCURACY
from slipcore.contact.elasticity.grid import Grid
from slipcore.contact.plan.plan import SamplingPlan
from slipcore.contact.tiers.sampling import SensorGrid, frame_record, frame_times, sensor_grid, untouched

GRID = SensorGrid(Grid((7, 8), (1e-3, 1e-3)), (2, 1), 3)
"""Two points along x and one along y, of 3 × 3 cells, in the middle of 8 × 7 cells."""


def test_cells_of_a_point_are_an_odd_number_and_the_grid_covers_contact_and_sensor() -> None:
    """20 cells across 10 mm are two a millimetre, so three; 30 of these cover the contact, and 31 the odd side."""
    made = sensor_grid(SamplingPlan((4, 3), 1e-3, 30.0), 5e-3, 20)
    assert (made.cells, made.points, made.grid.shape) == (3, (4, 3), (31, 30))
    assert made.grid.pitch == pytest.approx((1e-3 / 3.0, 1e-3 / 3.0))
    assert made.pitch == pytest.approx(1e-3)
    wide = sensor_grid(SamplingPlan((20, 3), 1e-3, 30.0), 5e-3, 10)  # a millimetre a cell, and a wide sensor
    assert (wide.cells, wide.grid.shape) == (1, (11, 20))


def test_without_a_sensor_every_cell_is_a_point() -> None:
    made = sensor_grid(None, 5e-3, 20)
    assert (made.cells, made.points, made.grid.shape) == (1, (20, 20), (20, 20))
    assert made.pitch == pytest.approx(0.5e-3)


def test_points_are_the_middle_cells_of_their_elements_and_elements_sum_all_of_theirs() -> None:
    """Rows 2 to 4 and columns 1 to 6 are seen: of a field of 10 · row + column, middles at row 3, columns 2 and 5."""
    field = 10.0 * np.arange(7)[:, None] + np.arange(8)
    np.testing.assert_array_equal(GRID.at_points(field), [[32.0], [35.0]])
    np.testing.assert_array_equal(GRID.over_elements(field), [[9.0 * 32.0], [9.0 * 35.0]])
    np.testing.assert_array_equal(GRID.over_elements(np.stack([field, -field]))[1], [[-288.0], [-315.0]])
    mask = field == 35.0
    np.testing.assert_array_equal(GRID.holds_at_points(mask), [[False], [True]])


def test_points_lie_a_pitch_apart_about_the_grids_middle() -> None:
    expected = [[[-1.5e-3, 0.0, 0.0]], [[1.5e-3, 0.0, 0.0]]]
    np.testing.assert_allclose(GRID.position(), expected, rtol=0, atol=1e-15)


@pytest.mark.parametrize(("duration", "rate", "frames"), [(1.0, 30.0, 31), (0.7, 10.0, 8), (0.75, 10.0, 8)])
def test_frames_go_from_zero_to_the_end_at_their_rate(duration: float, rate: float, frames: int) -> None:
    """7/10 s at 10 Hz are seven intervals though 0.7 · 10 is less in floating point."""
    plan = cast("Any", SimpleNamespace(duration=duration, sampling=SamplingPlan((2, 2), 1e-3, rate)))
    np.testing.assert_allclose(frame_times(plan), np.arange(frames) / rate, rtol=1e-15)
    plan.sampling = None
    assert len(frame_times(plan)) == ACCURACY.frames + 1
    assert frame_times(plan)[-1] == pytest.approx(duration)


def step(**fields: Any) -> Any:
    nothing = np.zeros((7, 8), bool)
    plain = {"moved": nothing, "contact": nothing, "at_limit": nothing, "pose": np.arange(3.0), "stick_ratio": 0.25}
    field = np.ones((3, 7, 8)) * np.array([1.0, 2.0, 3.0])[:, None, None]
    return SimpleNamespace(**{**plain, "displacement": field, "force": 0.1 * field, **fields})


def test_a_frame_has_its_last_step_with_z_outwards_and_what_moved_in_any() -> None:
    moved, touches = np.zeros((7, 8), bool), np.zeros((7, 8), bool)
    moved[3, 2] = touches[3, 5] = True
    record = frame_record(GRID, [step(moved=moved, stick_ratio=0.9), step(contact=touches, at_limit=touches)])
    np.testing.assert_allclose(record.displacement, [[[1.0, 2.0, -3.0]]] * 2)
    np.testing.assert_allclose(record.force, [[[0.9, 1.8, -2.7]]] * 2, rtol=1e-12)
    assert record.moved.tolist() == [[True], [False]]
    assert record.contact.tolist() == record.at_limit.tolist() == [[False], [True]]
    assert record.stick_ratio == 0.25
    np.testing.assert_array_equal(record.pose, [0.0, 1.0, 2.0])


def test_before_the_touch_a_frame_is_empty() -> None:
    record = untouched(GRID)
    assert record.displacement.shape == record.force.shape == (2, 1, 3)
    assert not any(each.any() for each in (record.displacement, record.force, record.pose))
    assert not any(each.any() for each in (record.contact, record.moved, record.at_limit))
    assert np.isnan(record.stick_ratio)
