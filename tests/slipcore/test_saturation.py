"""Readings at the end of a sensor's range."""

import numpy as np
import pytest

from slipcore import GraspLog
from slipcore.defaults import SATURATION
from slipcore.frames import FloatArray
from slipcore.saturation import RangeWatch, saturated


def pressed(shape: str, noise: float = 1e-6) -> FloatArray:
    """Displacements [30, 12, 12, 3] m that grow, stay and shrink: of a dome, or of a flat punch as wide as half."""
    load = np.concatenate((np.linspace(0.0, 1.0, 12), np.ones(8), np.linspace(0.9, 0.0, 10)))
    x, y = np.meshgrid(np.arange(12) - 5.3, np.arange(12) - 5.8, indexing="ij")
    away = np.hypot(x, y)
    depth = np.exp(-0.5 * (away / 3.0) ** 2) if shape == "dome" else np.minimum(1.0, 2.5 * np.exp(-away / 3.5))
    field = np.multiply.outer(load, np.stack((2e-5 * x * depth, 2e-5 * y * depth, -4e-4 * depth), axis=-1))
    return np.asarray(field + noise * np.random.default_rng(3).standard_normal(field.shape))


@pytest.mark.parametrize("step", [0.0, 1e-6, 2e-5])
@pytest.mark.parametrize("shape", ["dome", "flat punch"])
def test_what_is_clipped_along_one_axis_is_found_there_and_nowhere_else(shape: str, step: float) -> None:
    field = pressed(shape)
    field = np.round(field / step) * step if step else field
    clipped = field.copy()
    clipped[..., 2] = np.maximum(clipped[..., 2], -2e-4)
    at_end = np.isclose(clipped, -2e-4, rtol=1e-9, atol=0.0)  # multiples of a step differ in their last bits
    np.testing.assert_array_equal(saturated(clipped), at_end)


@pytest.mark.parametrize("step", [0.0, 1e-6, 5e-6, 2e-5, 5e-5])
@pytest.mark.parametrize("noise", [0.0, 1e-6, 1e-5])
@pytest.mark.parametrize("shape", ["dome", "flat punch"])
def test_equal_readings_by_rounding_are_no_end_of_a_range(shape: str, noise: float, step: float) -> None:
    field = pressed(shape, noise)
    assert not saturated(np.round(field / step) * step if step else field).any()


def test_copies_of_frames_and_frozen_markers_are_no_end_of_a_range() -> None:
    field = pressed("dome")
    field[14:, 5, 6] = field[14, 5, 6] * 1.2  # the largest from then on, again and again
    assert not saturated(np.repeat(field, 2, axis=0)).any()


def test_markers_that_were_not_seen_do_not_count() -> None:
    field = pressed("dome")
    field[..., 2] = np.maximum(field[..., 2], -2e-4)
    assert not saturated(field, (field[..., 2] > -2e-4)).any()


def test_a_field_of_zeros_has_no_end() -> None:
    assert not saturated(np.zeros((5, 4, 4, 3))).any()


def test_real_recordings_are_within_their_range_until_it_is_cut(recording: GraspLog) -> None:
    assert recording.force is not None
    for field in (recording.displacement, recording.force):
        assert not saturated(field).any()
        top = 0.7 * np.abs(field[..., 2]).max()
        cut = np.clip(field, [-np.inf, -np.inf, -top], [np.inf, np.inf, top])
        assert saturated(cut)[cut != field].all()


@pytest.mark.parametrize("step", [0.0, 1e-6, 2e-5])
@pytest.mark.parametrize("shape", ["dome", "flat punch"])
def test_in_a_stream_clipped_readings_are_found_while_they_come(shape: str, step: float) -> None:
    field = pressed(shape)
    field = np.round(field / step) * step if step else field
    clipped = field.copy()
    clipped[..., 2] = np.maximum(clipped[..., 2], -2e-4)
    watch = RangeWatch()
    found = np.stack([watch.step(frame) for frame in clipped])
    at_end = np.isclose(clipped, -2e-4, rtol=1e-9, atol=0.0)
    assert not (found & ~at_end).any()
    held = slice(12, None)  # the load has grown beyond the range for some frames
    np.testing.assert_array_equal(found[held], at_end[held])


@pytest.mark.parametrize("step", [0.0, 1e-6, 5e-6, 2e-5, 5e-5])
@pytest.mark.parametrize("shape", ["dome", "flat punch"])
def test_in_a_stream_equal_readings_by_rounding_are_no_end_of_a_range(shape: str, step: float) -> None:
    field = pressed(shape)
    watch = RangeWatch()
    assert not any(watch.step(np.round(frame / step) * step if step else frame).any() for frame in field)


def test_a_range_goes_on_where_a_larger_reading_comes() -> None:
    field = pressed("dome")
    clipped = field.copy()
    clipped[:15, ..., 2] = np.maximum(clipped[:15, ..., 2], -2e-4)
    watch = RangeWatch()
    found = [watch.step(frame).any() for frame in clipped]
    assert found[14]
    assert not any(found[15:])


def test_a_stream_remembers_its_frames_in_their_order_and_of_several_what_all_reach() -> None:
    """Whose readings grow by 1 from frame to frame: of those that became one, it is the first."""
    watch, most = RangeWatch(), 5 * SATURATION.kept
    for load in range(1, most + 1):
        watch.step(np.full((4, 4, 3), float(load)))
    kept = [float(frame[0, 0, 0]) for frame in watch._kept]
    assert kept == sorted(set(kept))
    assert (kept[0], kept[-1]) == (1.0, float(most))
    spans = np.diff(kept)
    assert np.all(np.diff(spans) <= 0.0), "what is long ago is remembered no more finely"


def test_a_stream_remembers_few_frames() -> None:
    watch, rng = RangeWatch(), np.random.default_rng(5)
    for _ in range(300):
        watch.step(rng.standard_normal((4, 4, 3)))
    assert len(watch._kept) <= SATURATION.kept


@pytest.mark.parametrize("copies", [1, 4])
def test_frames_that_repeat_the_one_before_say_neither_that_nor_otherwise(copies: int) -> None:
    """Each element is at the end now and then, so that none around tells: what else is read tells it, once a frame."""
    field = np.zeros((40, 4, 4, 3))
    field[..., 0] = np.minimum(np.random.default_rng(1).random((40, 4, 4)), 0.7)
    found = saturated(np.repeat(field, copies, axis=0))
    np.testing.assert_array_equal(found, np.repeat(field == 0.7, copies, axis=0))
