"""The force that is told against the one that is known."""

from dataclasses import replace

import numpy as np
import pytest

from slipcore.calibration.defaults import ESTIMATE
from slipcore.calibration.estimate import PressEstimate
from slipcore.calibration.gain import gain
from slipcore.calibration.press import PressLog, find_press
from tests.slipcore.calibration.straight_press import LOAD, STEP, press, shares, straight


def test_a_gain_is_known_force_over_told_force() -> None:
    found = gain(press(newton=2.0), 3.0)
    assert isinstance(found, PressEstimate)
    assert found.value == pytest.approx(1.5, rel=1e-12)
    assert found.error == pytest.approx(0.0, abs=1e-12)


def test_its_error_is_that_of_the_zero_of_all_elements() -> None:
    noise = np.zeros((len(LOAD), 1, 1, 3))
    noise[LOAD == 0.0, ..., 2] = 1e-4 * np.where(np.arange(24) % 2, 1.0, -1.0)[:, None, None]
    seen = press(newton=2.0, added=noise)
    found = gain(seen, 2.0)
    assert isinstance(found, PressEstimate)
    assert seen.zero is not None
    told = -seen.log.force[seen.held, ..., 2].sum(axis=(1, 2)).mean()  # type: ignore[index]
    assert found.error == pytest.approx(2.0 / told * 64 * seen.zero.offset_error[2] / told, rel=1e-3)


@pytest.mark.parametrize("kept", [slice(0, 26), slice(12, None)])
def test_a_drift_that_one_side_leaves_open_is_in_what_more_presses_do_not_average_out(kept: slice) -> None:
    drift = -1e-3 * STEP * np.arange(len(LOAD))[:, None, None, None] * np.array([0.0, 0.0, 1.0])
    found = gain(find_press(straight(newton=2.0, added=drift).take(kept)), 2.0)
    assert isinstance(found, PressEstimate)
    assert abs(found.value - 1.0) > 0.02
    assert abs(found.value - 1.0) < 1.96 * found.shared
    both = gain(press(newton=2.0, added=drift), 2.0)
    assert isinstance(both, PressEstimate)
    assert both.value == pytest.approx(1.0, rel=1e-9)
    assert both.shared == 0.0


def gripped(reading: np.ndarray, deviation: float | None = None) -> PressLog:
    """A press of 2 N by a sensor that tells half of it, and what the gripper reported."""
    told = straight(newton=1.0)
    return find_press(replace(told, gripper_force=reading, gripper_force_deviation=deviation))


def test_without_a_known_force_the_grippers_is_taken_as_well_as_it_is_known() -> None:
    found, stated = gain(gripped(2.0 * LOAD), None), gain(gripped(2.0 * LOAD, 0.1), None)
    assert isinstance(found, PressEstimate)
    assert isinstance(stated, PressEstimate)
    assert found.value == pytest.approx(2.0, rel=1e-12)
    assert found.shared == pytest.approx(2.0 * ESTIMATE.force_tolerance)
    assert stated.shared == pytest.approx(2.0 * 0.1 / 2.0)


def test_only_frames_in_which_the_gripper_reports_count_and_a_known_force_goes_first() -> None:
    late = np.where(np.arange(len(LOAD)) > 18, 2.0 * LOAD, 0.0)
    found = gain(gripped(late), None)
    assert isinstance(found, PressEstimate)
    assert found.value == pytest.approx(2.0, rel=1e-12)
    known = gain(gripped(late, 0.1), 3.0)
    assert isinstance(known, PressEstimate)
    assert (known.value, known.shared) == (pytest.approx(3.0, rel=1e-12), 0.0)


REFUSED: dict[str, tuple[PressLog, float | None]] = {
    "no total force is given": (press(), None),
    "record the gripper's force": (gripped(0.0 * LOAD), None),
    "the log has no forces": (find_press(replace(straight(), force=None)), 2.0),
    "no frames without contact": (press(load=LOAD[14:24]), 2.0),
    "reaches the lattice's edge": (press(share=shares(5e-3)), 2.0),
}


@pytest.mark.parametrize("reason", REFUSED)
def test_what_hides_a_gain_is_said(reason: str) -> None:
    assert reason in str(gain(*REFUSED[reason]))
