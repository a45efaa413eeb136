"""Slip from forces alone, on arrays of separate pillars in closed form (benchmarks/detector/pillars.py)."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.detector.accuracy import count
from benchmarks.detector.pillars import Grasp
from benchmarks.detector.scenes import observed
from slipcore import GraspLog, InvalidInput, SlipDetector, SlipHistory, detect_slip
from slipcore.detection.forces_only.tuning import frictions

MARKER_NOISE, FORCE_NOISE = 5e-6, 1e-2
PRESSED = -1e-4, -1e-4, 1e-3, 1e-3


def ramp(friction: float = 0.5, hold: float = 0.0, reach: float = 2e-3, seed: int = 40) -> GraspLog:
    """Pressed within 0.7 s, then pulled sideways until 2.4 s, and held."""
    time = (0.0, 0.2, 0.7, 0.9, 2.4, 2.5 + hold)
    return Grasp("ramp", friction, time, (*PRESSED, 1e-3, 1e-3), x=(0.0, 0.0, 0.0, 0.0, reach, reach),
                 tilt=(0.02, -0.01), seed=seed).log().log  # fmt: skip


def seen(log: GraspLog, seed: int = 0) -> GraspLog:
    return replace(observed(log, MARKER_NOISE, FORCE_NOISE, "force", seed), displacement=None)


def f1_and_false_slip(log: GraspLog, history: SlipHistory) -> tuple[float, float]:
    assert log.truth is not None
    slips = log.truth.slip_contact_factor & log.truth.contact
    sticks = log.truth.contact & ~slips
    return count(slips, history.slip & log.truth.contact).f1, float((history.slip & sticks).sum() / sticks.sum())


@pytest.mark.parametrize("friction", [0.25, 0.5, 0.8])
def test_pillars_that_slip_are_found_whatever_the_friction(friction: float) -> None:
    log = ramp(friction, reach=4e-3 * friction)
    f1, false_slip = f1_and_false_slip(log, detect_slip(seen(log), "forces_only"))
    assert f1 > 0.85
    assert false_slip < 0.05


@pytest.mark.parametrize("friction", [0.3, 0.6])
def test_the_friction_that_is_believed_in_the_end_is_the_true_one(friction: float) -> None:
    log = seen(ramp(friction, reach=4e-3 * friction))
    detector = SlipDetector(log.position, log.element_area, "forces_only")
    for frame in log.frames():
        detector.step(frame.time, frame.displacement, frame.force, None, frame.normal)
    state, grid = detector.state, frictions(detector.state.setup.options)
    likeliest = grid[np.argmax(state.of_method.friction)]
    assert abs(np.log(likeliest / friction)) < np.log(grid[1] / grid[0])


def test_a_press_alone_slips_nowhere() -> None:
    log = seen(ramp(reach=0.0, hold=0.5))
    assert not detect_slip(log, "forces_only").slip.any()


@pytest.mark.parametrize("hold", [5.0, pytest.param(30.0, marks=pytest.mark.long)])
@pytest.mark.parametrize("reach", [0.0, 5e-4])
def test_what_is_held_neither_slips_nor_changes_its_probability(reach: float, hold: float) -> None:
    log = seen(ramp(reach=reach, hold=hold))
    history = detect_slip(log, "forces_only")
    held = log.time > 2.6
    assert history.slip[held].mean() < 0.005
    assert np.ptp(history.probability[held], axis=0).max() < 0.1


def test_a_copied_frame_changes_nothing_for_long() -> None:
    log = seen(ramp())
    k = int(np.argmax(log.time > 1.5))
    stopped = log.take(np.r_[: k + 1, np.arange(k + 1, len(log))])
    force = np.concatenate([log.force[: k + 1], np.broadcast_to(log.force[k], (len(log) - k - 1, 3, 3, 3))])
    history = detect_slip(replace(stopped, force=force), "forces_only")
    settled = log.time > log.time[k] + 0.3
    assert np.ptp(history.probability[settled], axis=0).max() == 0.0


def test_forces_ten_times_as_large_slip_the_same() -> None:
    log = replace(ramp(), displacement=None)
    larger = replace(log, force=10.0 * log.force, element_area=10.0 * log.element_area)
    few, many = (detect_slip(each, "forces_only") for each in (log, larger))
    np.testing.assert_array_equal(many.contact, few.contact)
    np.testing.assert_allclose(many.probability, few.probability, rtol=0.0, atol=1e-9)


def test_all_stick_again_while_the_grip_tightens() -> None:
    time = (0.0, 0.2, 0.7, 0.9, 1.9, 2.0, 2.6)
    grasp = Grasp("tightens", 0.4, time, (*PRESSED, 1e-3, 1e-3, 2e-3), x=(0.0, 0.0, 0.0, 0.0, 1.0e-3, 1.0e-3, 1.0e-3),
                  seed=41)  # fmt: skip
    log = grasp.log().log
    history = detect_slip(seen(log), "forces_only")
    slips = history.slip.mean(axis=(1, 2))
    assert slips[(log.time > 1.8) & (log.time < 1.9)].mean() > 0.4
    assert not slips[log.time > 2.3].any()


def test_without_forces_nothing_is_known() -> None:
    log = replace(observed(ramp(), MARKER_NOISE, FORCE_NOISE, "displacement"), contact=None)
    history = detect_slip(log, "forces_only")
    assert not history.slip.any()
    assert set(np.unique(history.probability)) <= {0.0, 0.5}


def test_a_log_of_forces_alone_is_left_to_this_method() -> None:
    log = seen(ramp())
    assert not log.has_displacement
    history = detect_slip(log)
    assert history.method == "forces_only"
    assert history.slip.any()
    assert np.isnan(history.velocity).all()
    assert detect_slip(log, "force_ratio").method == "force_ratio"


def test_a_log_with_neither_displacement_nor_forces_is_refused() -> None:
    log = ramp()
    with pytest.raises(InvalidInput, match="displacement"):
        replace(log, displacement=None, force=None)
