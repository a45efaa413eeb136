"""Noise between a given pose and the markers, of a camera that shakes or of who gives the pose, is no slip."""

import math
from collections.abc import Callable
from dataclasses import replace
from inspect import unwrap

import numpy as np
import pytest

from slipcore import FilterOptions, GraspLog, SlipHistory, detect_slip
from slipcore.contact import RampSchedule, tangential_ramp
from slipcore.detection.detector import init, step
from slipcore.detection.filter import pose_noise, surface_motion
from slipcore.detection.filter.pose import PoseVariance, pose_at
from slipcore.detection.filter.state import COMMON, CORRECTION
from slipcore.detection.filter.tuning import Tuning, settings_of

Score = Callable[[GraspLog, SlipHistory], float]


@pytest.fixture(scope="module")
def ramp() -> GraspLog:
    """A grasp whose object's pose is known."""
    schedule = RampSchedule(rest=0.5, press=0.5, settle=0.3, shear=2.0, hold=0.7)
    made = tangential_ramp(points=20, schedule=schedule, marker_noise=1e-6, force_noise=2e-3, seed=11)
    assert made.object_pose is not None
    return made


def shaken(log: GraspLog, size: float) -> GraspLog:
    """All markers move alike along the surface, anew in each frame."""
    jerk = size * np.random.default_rng(1).standard_normal((len(log), 1, 1, 3)) * [1.0, 1.0, 0.0]
    return replace(log, displacement=log.displacement + jerk)


def misplaced(log: GraspLog, size: float) -> GraspLog:
    """The pose errs anew in each frame, 3 mm from its middle as much by its yaw as there by its place."""
    assert log.object_pose is not None
    jerk = size * np.random.default_rng(1).standard_normal((len(log), 3)) * [1.0, 1.0, 1.0 / 3e-3]
    return replace(log, object_pose=log.object_pose + jerk)


@pytest.mark.parametrize("size", [3e-6, 1e-5])
@pytest.mark.parametrize("fault", [shaken, misplaced])
def test_a_noisy_pose_is_hardly_worse_than_none(
    ramp: GraspLog, fault: Callable[[GraspLog, float], GraspLog], size: float, f1_score: Score
) -> None:
    log = fault(ramp, size)
    without = f1_score(log, detect_slip(replace(log, object_pose=None), surroundings_least=1_000_000))
    found = float(f1_score(log, detect_slip(log)))
    assert found > without - 0.05  # 0.3 to 0.5 less where the pose is taken for exact


def test_a_shake_while_nothing_moves_is_no_slip() -> None:
    pressed = tangential_ramp(points=12, pitch=1.2e-3, tangential_force=0.0, marker_noise=1e-6, seed=2)
    log = shaken(pressed, 1e-5)
    assert detect_slip(log).slip[20:].mean() < 0.005


@pytest.mark.parametrize("size", [1e-6, 1e-5])
def test_a_surface_does_not_stay_behind_what_is_only_noise(size: float) -> None:
    pressed = tangential_ramp(points=12, pitch=1.2e-3, tangential_force=0.0, marker_noise=1e-6, seed=2)
    log, state = misplaced(pressed, size), init(pressed.position, pressed.element_area)
    for frame in log.frames():
        state, _ = step(state, frame)
    share = unwrap(surface_motion.following_share)  # compiling it would take seconds
    assert share(state.memory.common, Tuning(*settings_of(FilterOptions()))) == 1.0


def test_without_noise_the_pose_is_believed(ramp: GraspLog, f1_score: Score) -> None:
    assert f1_score(ramp, detect_slip(ramp)) > 0.93


def test_the_deviation_of_white_noise_is_found_in_each_coordinate() -> None:
    noise = unwrap(pose_noise._noise)
    rng, common, sizes = np.random.default_rng(5), np.zeros(COMMON), np.array([2e-6, 2e-6, 7e-4])
    found = np.array([noise(sizes * rng.standard_normal(3), common)[:2] for _ in range(3000)])
    np.testing.assert_allclose(found[100:].mean(axis=0), sizes[1:], rtol=0.05)  # 3000 frames, 31 at a time: 2 %


@pytest.mark.parametrize(
    ("of_noise", "of_fit", "of_slip", "share"),
    [(4.0, 1.0, 1.0, 0.75), (1.0, 1.0, 1.0, 0.0), (math.inf, 1.0, 9.0, 1.0), (2.0, 0.0, 1.0, 1.0)],
)
def test_the_markers_count_by_the_noise_that_is_beyond_slip(
    of_noise: float, of_fit: float, of_slip: float, share: float
) -> None:
    assert unwrap(pose_noise._share)(of_noise, of_fit, of_slip) == share


TUNING = Tuning(*settings_of(FilterOptions()))._replace(pose_noise_least=2.0, following_variance=0.5)


def test_noise_counts_beyond_what_may_be_the_fits_own() -> None:
    assert unwrap(pose_noise.own_variance)(3.0, 2.0, TUNING) == 5.0
    assert unwrap(pose_noise.own_variance)(1.0, 2.0, TUNING) == 0.0


def test_an_offset_is_that_where_the_fit_is_known_best() -> None:
    """A fit turned by a right angle about (1, 0), which a known pose at the origin leaves where it was."""
    fitted, known = pose_at(1.0, 1.0, 0.5 * math.pi, 1.0), pose_at(0.0, 0.0, 0.0, 1.0)
    offset = unwrap(pose_noise._offset)(known, fitted, PoseVariance(0.0, 0.0, 1.0, 0.0))
    np.testing.assert_allclose(offset, [1.0 + 1.0, 0.0 - 0.0, 0.5 * math.pi], atol=1e-15)


def test_a_known_pose_is_moved_by_the_share_of_its_noise_and_the_move_is_kept() -> None:
    """Noise of 3 and of 0.4 rad, of which twice the fit's variance is its own."""
    common, step = np.zeros(COMMON), np.zeros(3)
    known, fitted = pose_at(0.0, 0.0, 0.2, 1.0), pose_at(0.8, -1.6, 0.6, 1.0)
    spread, noise = PoseVariance(1.0, 0.04, 0.8, -1.6), pose_noise.PoseNoise(3.0, 0.4, True)
    moved, left = unwrap(pose_noise.without_noise)(known, step, fitted, spread, noise, TUNING, common)
    place, yaw = 7.0 / 8.0, 0.08 / (0.08 + 0.04)  # 9 − 2 over that and 1; 0.16 − 0.08 over that and 0.04
    np.testing.assert_allclose(moved, [place * 0.8, -place * 1.6, 0.2 + yaw * 0.4], rtol=1e-12)
    np.testing.assert_allclose(common[CORRECTION : CORRECTION + 3], moved - [0.0, 0.0, 0.2], rtol=1e-12)
    assert np.count_nonzero(common) == 3
    assert left == pytest.approx((place, yaw * 0.04, 0.8, -1.6))
