"""What no demonstration shows: each case is right, or ends in a named state."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

import slipcore
from slipcore import GraspLog, InvalidInput, SlipDetector
from slipcore.contact import RampSchedule, tangential_ramp

detect_slip = partial(slipcore.detect_slip, method="filter")

FRAMES, SIDE, PITCH = 60, 10, 1e-3
NOISE = 5e-7


def positions() -> np.ndarray:
    axis = (np.arange(SIDE) - 0.5 * (SIDE - 1)) * PITCH
    x, y = np.meshgrid(axis, axis, indexing="ij")
    return np.stack([x, y, np.zeros_like(x)], axis=-1)


def grasp(
    motion: np.ndarray, pressed: np.ndarray, interval: float = 1.0 / 30.0, pose: np.ndarray | None = None
) -> GraspLog:
    """A log of markers that move by ``motion`` [t, n, m, 2] m and bear 0.1 N where ``pressed`` [t, n, m]."""
    displacement = NOISE * np.random.default_rng(5).standard_normal((len(motion), SIDE, SIDE, 3))
    displacement[..., :2] += motion
    displacement[..., 2] -= 1e-3 * pressed
    force = 1e-3 * np.random.default_rng(6).standard_normal(displacement.shape)
    force[..., 2] -= 0.1 * pressed
    normal = np.broadcast_to([0.0, 0.0, 1.0], force.shape)
    return GraspLog(interval * np.arange(len(motion)), positions(), displacement, PITCH**2, force, normal, pose)


def everywhere() -> np.ndarray:
    return np.ones((FRAMES, SIDE, SIDE), bool)


def steadily(step: float = 1e-5) -> np.ndarray:
    return np.broadcast_to(
        step * np.arange(FRAMES)[:, None, None, None] * np.array([1.0, 0.5]), (FRAMES, SIDE, SIDE, 2)
    ).copy()


def turned(angle: np.ndarray) -> np.ndarray:
    x, y, _ = np.moveaxis(positions(), -1, 0)
    c, s = np.cos(angle)[:, None, None], np.sin(angle)[:, None, None]
    return np.stack([(c - 1.0) * x - s * y, s * x + (c - 1.0) * y], axis=-1)


def test_when_all_slip_at_once_and_the_object_is_known_it_is_macro_slip() -> None:
    motion = steadily()
    pose = np.concatenate([motion[:, 0, 0], np.zeros((FRAMES, 1))], axis=1)
    motion[30:] = motion[30]  # the surface lets go of the object, everywhere in the same frame
    history = detect_slip(grasp(motion, everywhere(), pose=pose))
    assert not history.slip[:30].any()
    assert history.macro_slip[33:].all()
    assert np.isfinite(history.velocity[33:]).all()


def test_when_all_slip_at_once_and_the_object_is_not_known_nothing_is_made_up() -> None:
    motion = steadily()
    motion[30:] = motion[30]  # looks exactly like an object that stops
    assert not detect_slip(grasp(motion, everywhere())).slip.any()


def test_when_nothing_ever_slips_none_does() -> None:
    assert not detect_slip(grasp(steadily(), everywhere())).slip.any()


@pytest.mark.parametrize("count", [1, 2, 3])
@pytest.mark.parametrize("known", [True, False])
def test_a_contact_of_so_few_elements_is_survived(count: int, known: bool) -> None:
    pressed = np.zeros((FRAMES, SIDE, SIDE), bool)
    pressed[5:, 4, 4 : 4 + count] = True
    motion = steadily()
    pose = np.concatenate([motion[:, 0, 0], np.zeros((FRAMES, 1))], axis=1) if known else None
    history = detect_slip(grasp(motion, pressed, pose=pose))
    assert (history.contact == pressed).all()
    assert not history.slip.any()
    if count == 1 and not known:  # one point tells no rotation
        assert np.isnan(history.velocity).all()


def test_a_single_row_of_contact_sticks_and_slips_but_a_single_row_of_markers_is_refused() -> None:
    pressed = np.zeros((FRAMES, SIDE, SIDE), bool)
    pressed[:, 4] = True
    motion = steadily()
    motion[20:, 4, :2] = motion[20, 4, :2]  # two of ten stay behind
    history = detect_slip(grasp(motion, pressed))
    assert history.slip[40, 4].tolist() == [True] * 2 + [False] * 8
    with pytest.raises(InvalidInput, match="at least 2 × 2 markers"):
        SlipDetector(positions()[:1], PITCH**2)


def test_a_contact_that_rolls_over_the_grid_does_not_slip() -> None:
    pressed = np.zeros((FRAMES, SIDE, SIDE), bool)
    for k in range(FRAMES):
        pressed[k, k // 10 : k // 10 + 4, 3:7] = True
    history = detect_slip(grasp(steadily(), pressed))
    assert not history.slip.any()
    assert len(history.events.touch) == 20


def test_duplicated_frames_change_no_decision() -> None:
    log = tangential_ramp(points=12, pitch=1.2e-3, schedule=RampSchedule(0.2, 0.4, 0.2, 1.0, 0.2), marker_noise=1e-6)
    twice = np.repeat(np.arange(len(log)), 2)
    time = log.time[twice] + np.tile([0.0, 1e-3], len(log))
    assert log.normal is not None
    assert log.force is not None
    doubled = GraspLog(
        time, log.position, log.displacement[twice], log.element_area, log.force[twice], log.normal[twice]
    )
    once, again = detect_slip(replace(log, object_pose=None)), detect_slip(doubled)
    assert np.count_nonzero(once.slip) > 400
    assert np.count_nonzero(once.slip ^ again.slip[1::2]) < 0.1 * np.count_nonzero(once.slip)


def test_the_surface_of_a_soft_object_stays_behind_its_body_without_slip() -> None:
    motion = steadily()
    pose = np.concatenate([2.5 * motion[:, 0, 0], np.zeros((FRAMES, 1))], axis=1)
    slips_at_last = motion.copy()
    slips_at_last[30:, :2] = motion[30, :2]
    assert not detect_slip(grasp(motion, everywhere(), pose=pose)).slip.any()
    history = detect_slip(grasp(slips_at_last, everywhere(), pose=pose))
    assert history.slip[40:, :2].all()
    assert not history.slip[:, 2:].any()


def test_saturated_frames_are_no_slip_and_leave_no_trace() -> None:
    motion = steadily()
    motion[20:, :2] = motion[20, :2]
    saturated = motion.copy()
    saturated[40:45] = np.minimum(saturated[40:45], 3.9e-4)  # markers stop where the sensor's range ends
    whole, clipped = (detect_slip(grasp(seen, everywhere())) for seen in (motion, saturated))
    assert not clipped.slip[:, 2:].any()
    np.testing.assert_array_equal(clipped.slip[50:], whole.slip[50:])


def test_a_marker_lost_and_found_elsewhere_is_no_slip_unless_it_stays_behind() -> None:
    log = grasp(steadily(), everywhere())
    displacement = log.displacement.copy()
    displacement[30, 5, 5, 1] += 1e-4
    assert not detect_slip(replace(log, displacement=displacement)).slip.any()


def test_a_frozen_sensor_reports_what_it_last_saw() -> None:
    motion = steadily()
    motion[20:, :2] = motion[20, :2]
    log = grasp(motion, everywhere())
    frozen = log.displacement.copy()
    frozen[40:] = frozen[40]
    history = detect_slip(replace(log, displacement=frozen))
    assert history.slip[40, :2].all()
    assert not history.slip[40, 2:].any()
    np.testing.assert_array_equal(history.slip[-1], history.slip[40])


def test_a_turn_by_thirty_degrees_is_no_slip() -> None:
    log = grasp(turned(np.linspace(0.0, np.pi / 6.0, FRAMES)), everywhere())
    history = detect_slip(log)
    assert np.count_nonzero(history.slip) <= 1e-3 * history.slip.size
    assert not history.slip[5:].any()  # once the noise is known


def test_an_object_that_moves_before_it_touches_does_not_slip_when_it_does() -> None:
    motion, pressed = np.zeros((FRAMES, SIDE, SIDE, 2)), everywhere()
    pressed[:30] = False
    pose = np.zeros((FRAMES, 3))
    pose[:, 0] = 1e-4 * np.arange(FRAMES)
    motion[30:, ..., 0] = (pose[30:, 0] - pose[30, 0])[:, None, None]
    history = detect_slip(grasp(motion, pressed, pose=pose))
    assert not history.slip.any()
    assert not history.contact[:30].any()


def test_frames_ten_seconds_apart_mean_the_same() -> None:
    motion = steadily()
    motion[20:, :2] = motion[20, :2]
    history = detect_slip(grasp(motion, everywhere(), interval=10.0))
    assert history.slip[-1, :2].all()
    assert np.count_nonzero(history.slip[:, 2:]) <= 1e-3 * history.slip.size
    assert not history.slip[5:, 2:].any()


@pytest.mark.parametrize("speed", [0.1, 10.0])
def test_a_tenth_and_ten_times_the_speed_are_detected_as_well(speed: float) -> None:
    def score(factor: float) -> float:
        schedule = RampSchedule(*(seconds / factor for seconds in (0.3, 0.7, 0.3, 2.0, 0.3)))
        log = tangential_ramp(schedule=schedule, frame_rate=30.0 * factor, marker_noise=1e-6, force_noise=2e-3)
        assert log.truth is not None
        true, found = log.truth.slip_contact_factor & log.truth.contact, detect_slip(log).slip & log.truth.contact
        return 2.0 * np.count_nonzero(true & found) / (np.count_nonzero(true) + np.count_nonzero(found))

    assert score(speed) > score(1.0) - 0.06


def test_one_percent_of_outlier_markers_costs_little() -> None:
    log = tangential_ramp(marker_noise=1e-6, force_noise=2e-3)
    assert log.truth is not None
    rng = np.random.default_rng(8)
    wild = rng.random(log.displacement.shape[:3]) < 0.01
    displacement = log.displacement + wild[..., None] * 5e-5 * rng.standard_normal(log.displacement.shape)
    true = log.truth.slip_contact_factor & log.truth.contact

    def score(seen: GraspLog) -> float:
        found = detect_slip(seen).slip & true | detect_slip(seen).slip & log.truth.contact
        return 2.0 * np.count_nonzero(true & found) / (np.count_nonzero(true) + np.count_nonzero(found))

    assert score(replace(log, displacement=displacement)) > score(log) - 0.03
