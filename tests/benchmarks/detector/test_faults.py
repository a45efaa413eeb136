"""Each fault of the benchmark does what its name says, and no more."""

import numpy as np
import pytest

from benchmarks.detector import faults as faults
from slipcore import GraspLog

FRAMES, SIDE = 400, 8


@pytest.fixture(scope="module")
def log() -> GraspLog:
    """A flat lattice that moves half a micrometre a frame along x, pressed evenly, with its object's pose."""
    axis = 1e-3 * np.arange(SIDE)
    position = np.stack([*np.meshgrid(axis, axis, indexing="ij"), np.zeros((SIDE, SIDE))], axis=-1)
    motion = 5e-7 * np.arange(FRAMES)[:, None, None, None] * np.array([1.0, 0.0, 0.0])
    displacement = np.broadcast_to(motion, (FRAMES, SIDE, SIDE, 3)).copy()
    force = np.broadcast_to([0.0, 0.0, -0.1], displacement.shape)
    pose = np.zeros((FRAMES, 3))
    return GraspLog(np.arange(FRAMES) / 30.0, position, displacement, 1e-6, force=force, object_pose=pose)


def difference(log: GraspLog, fault: faults.Fault) -> np.ndarray:
    return np.asarray(fault(log, np.random.default_rng(0)).displacement - log.displacement)


def test_a_shake_is_common_to_all_markers_and_along_the_surface(log: GraspLog) -> None:
    by = difference(log, faults.shake(3e-6))
    assert np.ptp(by, axis=(1, 2)).max() < 1e-15
    assert by[:, 0, 0, :2].std() == pytest.approx(3e-6, rel=0.1)
    assert not by[..., 2].any()


def test_correlated_noise_remembers_and_has_its_size(log: GraspLog) -> None:
    by = difference(log, faults.correlated(1e-5, 0.9))
    assert by.std() == pytest.approx(1e-5, rel=0.05)
    assert np.mean(by[1:] * by[:-1]) / by.var() == pytest.approx(0.9, abs=0.02)


def test_noise_of_the_pose_leaves_the_markers_alone(log: GraspLog) -> None:
    found = faults.pose_noise(3e-6)(log, np.random.default_rng(0))
    assert found.object_pose is not None
    np.testing.assert_array_equal(found.displacement, log.displacement)
    np.testing.assert_allclose(found.object_pose.std(axis=0), [3e-6, 3e-6, 1e-3], rtol=0.2)


def test_rounding_errs_by_half_a_step_at_most(log: GraspLog) -> None:
    found = faults.rounded(2e-5)(log, np.random.default_rng(0)).displacement
    assert np.abs(found / 2e-5 - np.round(found / 2e-5)).max() < 1e-9
    assert np.abs(found - log.displacement).max() <= 1e-5 * (1.0 + 1e-9)


def test_smoothing_keeps_what_is_even(log: GraspLog) -> None:
    assert np.abs(difference(log, faults.smoothed(1.0))).max() < 1e-15


def test_lost_markers_are_said_to_be_and_frozen_ones_are_not(log: GraspLog) -> None:
    lost = faults.lost(0.25)(log, np.random.default_rng(0))
    assert lost.observed is not None
    assert 0.1 < 1.0 - lost.observed.mean() < 0.4
    frozen = faults.frozen(0.25)(log, np.random.default_rng(0))
    assert frozen.observed is None
    still = (np.ptp(frozen.displacement[FRAMES // 2 :, ..., 0], axis=0) == 0.0).mean()
    assert 0.1 < still < 0.4


def test_a_marker_with_hysteresis_lags_by_its_play(log: GraspLog) -> None:
    by = difference(log, faults.hysteresis(5e-6))
    np.testing.assert_allclose(by[50:, ..., 0], -5e-6, rtol=1e-9)


def test_noise_after_smoothing_is_white(log: GraspLog) -> None:
    by = difference(log, faults.smoothed_then_noisy(1.0, 5e-7))
    assert by.std() == pytest.approx(5e-7, rel=0.02)
    assert abs(np.mean(by[:, 1:] * by[:, :-1])) < 0.02 * by.var()


def test_markers_that_lag_are_told_as_they_were_before(log: GraspLog) -> None:
    by = difference(log, faults.lagging(0.25, 0.11))
    lag = by[-1, ..., 0] != 0.0
    assert lag.mean() == pytest.approx(0.25, abs=0.15)
    np.testing.assert_allclose(by[10:, lag, 0], -4 * 5e-7, rtol=0.0, atol=1e-15)  # rounding
    assert not by[:, ~lag].any()
