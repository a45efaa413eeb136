"""The fit of the object's pose, against its own least squares in closed form."""

import math

import numpy as np
import pytest

from slipcore.detection.filter.pose import (
    AnchorMotion,
    Anchors,
    Pose,
    PoseVariance,
    fit_pose,
    object_motion,
    place_of_object,
    place_on_object,
    pose_at,
)

NOTHING_GIVEN = np.empty(0)
STIFF, LOOSE = 1e12, 1e4
"""Weights 1/m² of markers that are known to 1 µm, and to 10 mm: far worse than the object is rigid."""


def anchors(yaw: float, stretch: float, shift: tuple[float, float] = (0.0, 0.0)) -> Anchors:
    """Sixteen places on an object 10 mm wide that was turned, stretched about its middle, and moved."""
    x, y = (axis.ravel() for axis in np.meshgrid(*[np.linspace(-5e-3, 5e-3, 4)] * 2))
    c, s = stretch * math.cos(yaw), stretch * math.sin(yaw)
    return Anchors(
        x, y, np.zeros(16), c * x - s * y + shift[0], s * x + c * y + shift[1], np.ones(16), *np.empty((2, 16))
    )


def spread(places: Anchors, weight: float) -> float:
    return float(weight * np.sum(places.x**2 + places.y**2))


def fitted(places: Anchors, weight: float, given: tuple[float, float, float] | None = None) -> Pose:
    pose, _ = fit_pose(places, np.full(16, weight), NOTHING_GIVEN if given is None else np.array(given))
    return pose


@pytest.mark.parametrize("weight", [STIFF, LOOSE])
def test_yaw_and_place_are_those_of_procrustes(weight: float) -> None:
    pose = fitted(anchors(0.3, 1.0, (1e-3, -2e-3)), weight)
    assert pose.yaw == pytest.approx(0.3, rel=1e-12)
    np.testing.assert_allclose([pose.x, pose.y], [1e-3, -2e-3], rtol=0, atol=1e-15, err_msg="where the middle went")


@pytest.mark.parametrize("weight", [STIFF, LOOSE])
def test_the_stretch_is_believed_as_far_as_markers_tell_it_better_than_linear_theory(weight: float) -> None:
    """Beforehand √(1 + φ²) − 1 ≈ φ²/2 of linear rotation; the fit's own variance is 1/Σw p²."""
    places, yaw, stretch = anchors(0.3, 1.05), 0.3, 1.05
    before = yaw**4 / 4.0
    believed = before / (before + 1.0 / spread(places, weight))
    assert fitted(places, weight).stretch - 1.0 == pytest.approx(believed * (stretch - 1.0), rel=1e-5)


@pytest.mark.parametrize("weight", [STIFF, LOOSE])
def test_a_given_yaw_is_kept_as_far_as_markers_tell_it_worse(weight: float) -> None:
    """Beforehand atan φ of linear rotation, which errs by φ³/3."""
    places, given = anchors(0.32, 1.0), 0.3
    before = given**6 / 9.0
    believed = before / (before + 1.0 / spread(places, weight))
    pose = fitted(places, weight, (7e-3, 8e-3, given))
    assert pose.yaw - given == pytest.approx(believed * 0.02, rel=1e-4)
    assert (pose.x, pose.y) == (7e-3, 8e-3)


def test_variances_are_those_of_weighted_means() -> None:
    places = anchors(0.1, 1.0)
    _, variance = fit_pose(places, np.full(16, LOOSE), NOTHING_GIVEN)
    assert variance.place == pytest.approx(1.0 / (16 * LOOSE), rel=1e-12)
    assert variance.yaw == pytest.approx(1.0 / spread(places, LOOSE), rel=1e-12)


def test_a_place_goes_to_the_object_and_back() -> None:
    pose = pose_at(1e-3, -2e-3, 2.5, 1.02)
    there = place_of_object(pose, 3e-3, 4e-3)
    np.testing.assert_allclose(place_on_object(pose, *there), [3e-3, 4e-3], rtol=1e-12, err_msg="rounding")


@pytest.mark.parametrize(("moved", "kept"), [(1e-5, 1.0 - 0.2), (1e-4, 1.0 - 0.02), (1e-6, 0.0), (0.0, 0.0)])
def test_of_a_motion_is_left_what_its_jitter_does_not_explain(moved: float, kept: float) -> None:
    """(1 − √(Σσ²/Σd²)) d, for a deviation of 2 µm and a play of one deviation."""
    places, motion = anchors(0.0, 1.0), AnchorMotion(*np.empty((3, 16)))
    start, end, spread = pose_at(0.0, 0.0, 0.0, 1.0), pose_at(moved, 0.0, 0.0, 1.0), PoseVariance(4e-12, 0.0, 0.0, 0.0)
    reference = object_motion(places, start, start, end, spread, 1.0, motion)
    np.testing.assert_allclose(motion.x, kept * moved, rtol=1e-9, atol=1e-15)
    np.testing.assert_allclose(motion.variance, 4e-12, rtol=1e-12)
    assert reference.x == pytest.approx(kept * moved, rel=1e-9, abs=1e-15)


@pytest.mark.parametrize(
    ("yaw_deviation", "turn", "held"),
    [(5e-3, 4e-3, True), (5e-3, 6e-3, False), (1e-4, 0.9e-4, False)],
    ids=["open", "far beyond its deviation", "known nearly as well as the place"],
)
def test_a_yaw_that_few_markers_leave_open_is_held_and_hides_no_motion(
    yaw_deviation: float, turn: float, held: bool
) -> None:
    """Known to 2 µm at the corner at which two elements stick; held, it is seen to move by 20 µm, less a tenth."""
    places, motion = anchors(0.0, 1.0), AnchorMotion(*np.empty((3, 16)))
    spread = PoseVariance(4e-12, yaw_deviation**2, 5e-3, 5e-3)
    start, turned = pose_at(0.0, 0.0, 0.0, 1.0), pose_at(0.0, 0.0, turn, 1.0)
    x, y = place_of_object(turned, 5e-3, 5e-3)
    end = pose_at(5e-3 + 20e-6 - x, 5e-3 - y, turn, 1.0)  # the corner moves along x
    reference = object_motion(places, start, start, end, spread, 1.0, motion)
    if held:
        np.testing.assert_allclose(motion.x, 0.9 * 20e-6, rtol=1e-4)
        np.testing.assert_allclose(motion.y, 0.0, rtol=0, atol=1e-7)
        np.testing.assert_allclose(motion.variance, 4e-12, rtol=1e-12)
        assert reference.yaw == 0.0
    else:
        assert np.ptp(motion.variance) > 0.0
        assert reference.yaw != 0.0 or not motion.x.any()


def test_what_a_pose_strayed_while_it_was_unsure_is_no_motion_once_it_is_known() -> None:
    """It lay 30 µm off when that was within its deviation; now it is known to 2 µm, and has moved by 5 µm more."""
    places, motion = anchors(0.0, 1.0), AnchorMotion(*np.empty((3, 16)))
    start, before, end = (pose_at(x, 0.0, 0.0, 1.0) for x in (0.0, 30e-6, 35e-6))
    spread = PoseVariance(4e-12, 0.0, 0.0, 0.0)
    reference = object_motion(places, start, before, end, spread, 1.0, motion)
    np.testing.assert_allclose(motion.x, 5e-6, rtol=1e-9)
    assert reference.x == pytest.approx(33e-6, rel=1e-9)  # and lags by a deviation, as ever
    object_motion(places, start, before, before, spread, 1.0, motion)
    np.testing.assert_allclose(motion.x, 0.0, rtol=0, atol=1e-15)


def test_of_a_long_motion_all_but_one_play_counts_however_many_frames_it_is_cut_into() -> None:
    spread, total = PoseVariance(4e-12, 0.0, 0.0, 0.0), 100e-6
    for frames in (1, 10, 1000):
        reference = before = pose_at(0.0, 0.0, 0.0, 1.0)
        moved = 0.0
        for x in np.linspace(0.0, total, frames + 1)[1:]:
            places, motion = anchors(0.0, 1.0), AnchorMotion(*np.empty((3, 16)))
            pose = pose_at(x, 0.0, 0.0, 1.0)
            reference = object_motion(places, reference, before, pose, spread, 3.0, motion)
            moved, before = moved + motion.x[0], pose
        assert moved == pytest.approx(total - 6e-6, rel=1e-9)


@pytest.mark.parametrize("turned", [0.0, 0.2, 0.7])
def test_the_pose_that_corrects_a_given_one_jitters_as_its_variance_states(turned: float) -> None:
    """Yaw and stretch, by which places move alike, over 2000 draws of 1 µm of noise on markers."""
    rng, places, found = np.random.default_rng(6), anchors(turned, 1.0), []
    for _ in range(2000):
        noisy = places._replace(
            marker_x=places.marker_x + 1e-6 * rng.standard_normal(16),
            marker_y=places.marker_y + 1e-6 * rng.standard_normal(16),
        )
        pose, variance = fit_pose(noisy, np.full(16, STIFF), np.array([0.0, 0.0, turned]))
        found.append((pose.yaw, pose.stretch))
    jitter = float(np.var(found, axis=0).sum())
    assert jitter == pytest.approx(variance.yaw, rel=0.1, abs=1e-12), "four deviations of such a variance"
