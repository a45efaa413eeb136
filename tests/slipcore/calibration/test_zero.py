"""Offset and drift of forces that were put in exactly."""

import numpy as np
import pytest

from slipcore.calibration.estimate import PressEstimate
from slipcore.calibration.zero import drifts, elapsed, find_zero, offsets
from slipcore.frames import FloatArray
from tests.slipcore.calibration.straight_press import GRID, LOAD, STEP, straight

OFFSET = 1e-3 * np.random.default_rng(1).standard_normal((*GRID, 3))
DRIFT = np.array([1e-3, -2e-3, 3e-3])
TIME = STEP * np.arange(len(LOAD))
FREE = LOAD == 0.0


def faulty(load: FloatArray = LOAD, noise: FloatArray | float = 0.0) -> FloatArray:
    return OFFSET + STEP * np.arange(len(load))[:, None, None, None] * DRIFT + noise


def test_offset_and_drift_are_found_to_the_last_digit() -> None:
    log = straight(added=faulty())
    zero = find_zero(log, FREE)
    assert zero is not None
    assert zero.around
    assert zero.frames == 24
    np.testing.assert_allclose(zero.drift, DRIFT, rtol=1e-9, err_msg="rounding")
    np.testing.assert_allclose(zero.offset, OFFSET, rtol=0.0, atol=1e-14, err_msg="rounding")
    np.testing.assert_allclose(zero.taken_from(log), straight().force, rtol=0.0, atol=1e-13, err_msg="rounding")
    np.testing.assert_allclose(np.r_[zero.offset_error, zero.drift_error], 0.0, rtol=0.0, atol=1e-14)
    assert elapsed(log)[[0, -1]] == pytest.approx([0.0, TIME[-1]])


@pytest.mark.parametrize("free", [TIME < 1.2, TIME >= 2.6], ids=["before", "after"])
def test_without_free_frames_on_both_sides_no_drift_is_taken_off(free: np.ndarray) -> None:
    log = straight(added=faulty())
    zero = find_zero(log, free)
    assert zero is not None
    assert not zero.around
    mean = OFFSET + TIME[free].mean() * DRIFT
    np.testing.assert_allclose(zero.offset, mean, rtol=0.0, atol=1e-14, err_msg="rounding")
    np.testing.assert_allclose(zero.taken_from(log)[free].mean(axis=0), 0.0, rtol=0.0, atol=1e-14)
    assert drifts(zero) == [drifts(zero)[0]] * 3
    assert "both before the press and after it" in str(drifts(zero)[0])


def test_errors_are_those_of_a_straight_line() -> None:
    """(AᵀA)⁻¹ of offset and slope, for residuals that do not last from frame to frame."""
    noise = 1e-4 * np.where(np.arange(len(LOAD)) % 2, 1.0, -1.0)[:, None, None, None]
    zero = find_zero(straight(added=faulty(noise=noise)), FREE)
    assert zero is not None
    time = TIME[FREE]
    terms = np.stack([np.ones_like(time), time], axis=1)
    values = noise[FREE, 0, 0, 0]
    residual = values - terms @ np.linalg.lstsq(terms, values)[0]
    variance = residual @ residual / (len(time) - 1) * np.linalg.inv(terms.T @ terms)
    expected = np.sqrt(np.diag(variance))
    np.testing.assert_allclose(zero.offset_error, expected[0], rtol=1e-6, err_msg="rounding")
    np.testing.assert_allclose(zero.drift_error, expected[1], rtol=1e-6, err_msg="rounding")


def test_fewer_than_two_free_frames_tell_no_zero() -> None:
    one, two = (np.arange(len(LOAD)) < count for count in (1, 2))
    assert find_zero(straight(), one) is None
    assert find_zero(straight(), two) is not None
    assert "0 frames without contact; 10 are needed" in str(offsets(None)[2])
    assert drifts(None) == offsets(None)


@pytest.mark.parametrize(("frames", "is_known"), [(9, False), (10, True)])
def test_ten_free_frames_tell_an_offset(frames: int, is_known: bool) -> None:
    zero = find_zero(straight(added=faulty()), np.arange(len(LOAD)) < frames)
    found = offsets(zero)
    assert [isinstance(each, PressEstimate) for each in found] == [is_known] * 3
    if is_known:
        mean = OFFSET.mean(axis=(0, 1)) + TIME[:10].mean() * DRIFT
        np.testing.assert_allclose([each[0] for each in found], mean, rtol=0.0, atol=1e-14)  # rounding
    else:
        assert "9 frames" in str(found[0])
        assert "9 frames" in str(drifts(zero)[0])


def test_drift_between_free_frames_is_told_with_its_error() -> None:
    zero = find_zero(straight(added=faulty()), FREE)
    assert zero is not None
    found = drifts(zero)
    np.testing.assert_allclose([each[0] for each in found], DRIFT, rtol=1e-9)  # rounding
    assert [each[1] for each in found] == list(zero.drift_error)


def test_frames_free_within_a_press_are_not_after_it() -> None:
    """Touched in frames 3, 4 and 6 to the end."""
    free = np.ones(len(LOAD), bool)
    free[[3, 4]] = free[6:] = False
    zero = find_zero(straight(added=faulty()), free)
    assert zero is not None
    assert not zero.around
    assert zero.frames == 4
    assert find_zero(straight(added=faulty()), np.arange(len(LOAD)) < 1) is None
    two = find_zero(straight(added=faulty()), np.arange(len(LOAD)) < 2)
    assert two is not None
    assert two.frames == 2
