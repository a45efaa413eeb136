"""Markers around the contact tell how the camera shakes."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from slipcore import FilterOptions, GraspLog, SlipHistory, detect_slip
from slipcore.contact import RampSchedule, tangential_ramp
from slipcore.detection.filter.state import COMMON
from slipcore.detection.filter.surroundings import add_step, distance_from, share_of_jitter, usual_step
from slipcore.detection.filter.tuning import Tuning, settings_of

Score = Callable[[GraspLog, SlipHistory], float]
TUNING = Tuning(*settings_of(FilterOptions()))
BLIND = {"surroundings_least": 1_000_000}


@pytest.fixture(scope="module")
def made() -> GraspLog:
    schedule = RampSchedule(rest=0.5, press=0.5, settle=0.3, shear=2.0, hold=0.7)
    return tangential_ramp(points=20, schedule=schedule, marker_noise=1e-6, seed=11)


@pytest.fixture(scope="module")
def markers(made: GraspLog) -> GraspLog:
    """A grasp of which markers are all that is known."""
    return replace(made, force=None, normal=None, object_pose=None)


def shaken(log: GraspLog, size: float) -> GraspLog:
    jerk = size * np.random.default_rng(1).standard_normal((len(log), 1, 1, 3)) * [1.0, 1.0, 0.0]
    return replace(log, displacement=log.displacement + jerk)


@pytest.mark.parametrize("size", [2e-6, 1e-5, 1e-4])
def test_a_camera_that_shakes_hides_no_slip(markers: GraspLog, size: float, f1_score: Score) -> None:
    log = shaken(markers, size)
    assert f1_score(log, detect_slip(log)) > f1_score(markers, detect_slip(markers)) - 0.01
    if size > 5e-6:
        assert f1_score(log, detect_slip(log, **BLIND)) < f1_score(markers, detect_slip(markers)) - 0.1


@pytest.mark.parametrize("size", [3e-6, 1e-5, 1e-4])
def test_a_camera_that_shakes_spoils_no_given_pose(made: GraspLog, size: float, f1_score: Score) -> None:
    """Against the pose markers only seem to move; without the camera's share slip of the first half hides."""
    with_pose = replace(made, force=None, normal=None)
    log = shaken(with_pose, size)
    assert f1_score(log, detect_slip(log)) > f1_score(with_pose, detect_slip(with_pose)) - 0.02
    if size > 5e-6:
        assert f1_score(log, detect_slip(log, **BLIND)) < f1_score(with_pose, detect_slip(with_pose)) - 0.05


def test_without_jitter_nothing_is_taken_from_the_markers(markers: GraspLog) -> None:
    still = replace(markers, displacement=np.round(markers.displacement, 4))  # no noise, and no motion that jitters
    one, other = detect_slip(still), detect_slip(still, **BLIND)
    np.testing.assert_array_equal(one.slip, other.slip)


def share_after(steps: np.ndarray) -> float:
    common = np.zeros(COMMON)
    for u, v in steps:
        add_step(u, v, TUNING, common)
    return share_of_jitter(TUNING, common)


def test_all_motion_of_white_noise_of_place_is_jitter_and_none_of_an_even_motion() -> None:
    rng = np.random.default_rng(3)
    shares = [share_after(np.diff(5e-6 * rng.standard_normal((200, 2)), axis=0)) for _ in range(50)]
    assert np.mean(shares) == pytest.approx(0.93, abs=0.05)  # cut off at 1, with 60 values in mind
    assert share_after(np.full((200, 2), 3e-5)) == 0.0
    walks = [share_after(5e-6 * rng.standard_normal((200, 2))) for _ in range(50)]
    assert np.mean(walks) < 0.8  # a random walk of place jitters by its steps: three quarters
    assert share_after(np.full((200, 2), 1e-5) + 1e-17 * rng.standard_normal((200, 2))) < 1e-6  # rounding


def test_a_lost_marker_moves_no_camera() -> None:
    steps = np.zeros((3, 31))[:, :30]  # a part of a larger array, as the kernel is compiled for
    steps[:2] = 1e-6 + 1e-7 * np.random.default_rng(0).standard_normal((2, 30))
    kept = steps[:2, 1:].mean(axis=1)
    steps[0, 0] = 1e-3
    np.testing.assert_allclose(usual_step(steps, 6.0), kept, rtol=1e-12, atol=0.0)  # rounding of a sum


def test_distances_are_eight_percent_too_far_at_most() -> None:
    contact, distance = np.zeros((15, 21), bool), np.empty((15, 21))
    contact[4, 6] = contact[11, 13] = True
    assert distance_from(contact, np.zeros_like(contact), distance) == 2
    i, j = np.indices(contact.shape)
    exact = np.minimum(np.hypot(i - 4, j - 6), np.hypot(i - 11, j - 13))
    assert (distance >= exact - 1e-12).all()
    assert (distance <= 1.083 * exact).all()
    assert distance_from(np.zeros_like(contact), np.zeros_like(contact), distance) == 0
    assert np.isinf(distance).all()


@pytest.mark.parametrize("shape", [(1, 1), (1, 6), (6, 1), (5, 7)])
def test_distances_are_those_of_the_shortest_way_by_steps_aslant_and_along(shape: tuple[int, int]) -> None:
    """From any single element, whichever edge it lies at."""
    rows, columns = np.indices(shape)
    nothing, distance = np.zeros(shape, bool), np.empty(shape)
    for place in np.ndindex(shape):
        contact = nothing.copy()
        contact[place] = True
        along, across = abs(rows - place[0]), abs(columns - place[1])
        shortest = np.maximum(along, across) + (np.sqrt(2.0) - 1.0) * np.minimum(along, across)
        assert distance_from(nothing, contact, distance) == 1
        np.testing.assert_allclose(distance, shortest, rtol=1e-12)
