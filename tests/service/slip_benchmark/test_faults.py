"""Each fault against what its formula says of a log of noise."""

from dataclasses import replace

import numpy as np
import pytest

from service.slip_benchmark import faults
from slipcore import GraspLog

FRAMES, SIDE = 400, 5
PITCH = 1e-3


@pytest.fixture(scope="module")
def log() -> GraspLog:
    rng = np.random.default_rng(0)
    x, y = PITCH * np.mgrid[:SIDE, :SIDE]
    displacement, force = rng.normal(0.0, 1e-4, (2, FRAMES, SIDE, SIDE, 3))
    pose = rng.normal(0.0, 1e-4, (FRAMES, 3))
    position = np.stack([x, y, np.zeros_like(x)], axis=-1)
    time = np.arange(FRAMES) / 100.0
    return GraspLog(time, position, displacement, 1e-6, force=force, object_pose=pose)


def seen(fault: faults.Fault, log: GraspLog) -> GraspLog:
    return fault(log, np.random.default_rng(1))


def forces(log: GraspLog) -> np.ndarray:
    assert log.force is not None
    return log.force


def test_a_shake_moves_all_markers_alike_and_none_along_the_normal(log: GraspLog) -> None:
    by = seen(faults.shake(3e-5), log).displacement - log.displacement
    np.testing.assert_allclose(by, np.broadcast_to(by[:, :1, :1], by.shape), rtol=0.0, atol=1e-15)
    np.testing.assert_allclose(by[:, 0, 0].std(axis=0), [3e-5, 3e-5, 0.0], rtol=0.1, atol=1e-15)


def test_a_pose_errs_as_much_by_turning_at_3_mm(log: GraspLog) -> None:
    assert log.object_pose is not None
    pose = seen(faults.pose_noise(2e-5), log).object_pose
    assert pose is not None
    np.testing.assert_allclose((pose - log.object_pose).std(axis=0), [2e-5, 2e-5, 2e-5 / 3e-3], rtol=0.1)
    assert seen(faults.pose_noise(2e-5), replace(log, object_pose=None)).object_pose is None


def test_correlated_noise_is_as_large_from_the_first_frame_and_remembers(log: GraspLog) -> None:
    noise = seen(faults.correlated(1e-5), log).displacement - log.displacement
    assert noise[0].std() == pytest.approx(1e-5, rel=0.2)
    assert noise.std() == pytest.approx(1e-5, rel=0.05)
    assert (noise[1:] * noise[:-1]).mean() / noise.var() == pytest.approx(0.9, abs=0.02)


def test_rounding_tells_the_nearest_step(log: GraspLog) -> None:
    displacement = seen(faults.rounded(3e-5), log).displacement
    np.testing.assert_allclose(displacement / 3e-5, np.round(displacement / 3e-5), rtol=0.0, atol=1e-9)
    assert np.abs(displacement - log.displacement).max() <= 1.5e-5 * (1.0 + 1e-9)


def test_smoothing_is_over_neighbours_and_not_over_time(log: GraspLog) -> None:
    one = np.zeros_like(log.displacement)
    one[7, 2, 2, 0] = 1e-3
    wide = seen(faults.smoothed(0.8), replace(log, displacement=one, force=one))
    kernel = np.exp(-0.5 * (np.arange(-3, 4) / 0.8) ** 2)  # scipy cuts it at four deviations, rounded
    assert wide.displacement[7, 2, 2, 0] == pytest.approx(1e-3 / kernel.sum() ** 2, rel=1e-12)
    assert wide.displacement[7, 2, 3, 0] == pytest.approx(wide.displacement[7, 3, 2, 0], rel=1e-12)
    assert not wide.displacement[[6, 8]].any()
    assert not wide.displacement[..., 1:].any()
    np.testing.assert_array_equal(forces(wide), wide.displacement)
    assert seen(faults.smoothed(0.8), replace(log, force=None)).force is None


def test_noise_after_smoothing_is_not_smoothed(log: GraspLog) -> None:
    still = replace(log, displacement=np.zeros_like(log.displacement))
    noise = seen(faults.smoothed_then_noisy(0.8, 2e-5), still).displacement
    assert noise.std() == pytest.approx(2e-5, rel=0.02)
    assert abs((noise[:, 1:] * noise[:, :-1]).mean()) < 0.02 * noise.var()
    smooth = seen(faults.smoothed(0.8), log)
    told = seen(faults.smoothed_then_noisy(0.8, 0.0), log)
    np.testing.assert_array_equal(told.displacement, smooth.displacement)
    np.testing.assert_array_equal(forces(told), forces(smooth))


def test_lagging_markers_are_told_as_they_were_and_the_others_as_they_are(log: GraspLog) -> None:
    displacement = seen(faults.lagging(0.4, 0.035), log).displacement
    lags = (displacement != log.displacement).any(axis=(0, -1))
    assert 0.2 < lags.mean() < 0.6
    np.testing.assert_array_equal(displacement[4:, lags], log.displacement[:-4, lags])
    np.testing.assert_array_equal(displacement[:4, lags], log.displacement[[0] * 4][:, lags])


def test_lost_markers_are_said_to_be_lost_from_the_beginning(log: GraspLog) -> None:
    observed = seen(faults.lost(0.3), log).observed
    assert observed is not None
    assert 0.5 < observed.mean() < 0.9
    np.testing.assert_array_equal(observed, np.broadcast_to(observed[0], observed.shape))


def test_frozen_markers_stay_from_half_of_the_time_on(log: GraspLog) -> None:
    displacement = seen(faults.frozen(0.4), log).displacement
    half = FRAMES // 2
    still = (displacement[half:] == displacement[half]).all(axis=(0, -1))
    assert 0.2 < still.mean() < 0.6
    np.testing.assert_array_equal(displacement[half, still], log.displacement[half, still])
    np.testing.assert_array_equal(displacement[:half], log.displacement[:half])
    np.testing.assert_array_equal(displacement[:, ~still], log.displacement[:, ~still])


def test_hysteresis_lags_by_its_size_and_stays_where_motion_turns(log: GraspLog) -> None:
    there_and_back = 1e-5 * np.concatenate([np.arange(FRAMES // 2), np.arange(FRAMES // 2, 0, -1)])
    moved = np.broadcast_to(there_and_back[:, None, None, None], log.displacement.shape)
    told = seen(faults.hysteresis(5e-5), replace(log, displacement=moved)).displacement[:, 0, 0, 0]
    top = FRAMES // 2
    np.testing.assert_allclose(told[6:top], there_and_back[6:top] - 5e-5, rtol=1e-12)
    np.testing.assert_allclose(told[top : top + 10], there_and_back[top] - 5e-5, rtol=1e-12)
    np.testing.assert_allclose(told[top + 10 :], there_and_back[top + 10 :] + 5e-5, rtol=1e-12)


def test_a_tilt_turns_all_forces_by_its_angle_about_y(log: GraspLog) -> None:
    pressed = np.broadcast_to([0.0, 0.0, -1.0], log.displacement.shape)
    turned = forces(seen(faults.tilted(10.0), replace(log, force=pressed)))
    angle = np.radians(10.0)
    np.testing.assert_allclose(turned[3, 1, 1], [np.sin(angle), 0.0, -np.cos(angle)], rtol=1e-12)
    along = np.broadcast_to([0.0, 1.0, 0.0], log.displacement.shape)
    np.testing.assert_array_equal(forces(seen(faults.tilted(10.0), replace(log, force=along))), along)


def test_a_dome_tilts_forces_outwards_the_more_the_nearer_its_edge(log: GraspLog) -> None:
    pulled = np.broadcast_to([0.0, 0.0, 1.0], log.displacement.shape)
    told = forces(seen(faults.dome_forces(20.0), replace(log, force=pulled)))[0]
    angle = np.radians(20.0)
    np.testing.assert_allclose(told[2, 2], [0.0, 0.0, 1.0], rtol=0.0, atol=1e-15)
    corner = [np.sin(angle) / np.sqrt(2.0)] * 2
    np.testing.assert_allclose(told[4, 4], [*corner, np.cos(angle)], rtol=1e-12)
    np.testing.assert_allclose(
        told[4, 2], [np.sin(angle / 2**0.5), 0.0, np.cos(angle / 2**0.5)], rtol=1e-12, atol=1e-15
    )
    assert seen(faults.dome_forces(20.0), replace(log, force=None)).force is None


def test_a_gain_fades_evenly_to_a_half_of_what_it_was(log: GraspLog) -> None:
    told = forces(seen(faults.faded(slice(2, 3)), log))
    np.testing.assert_array_equal(told[..., :2], forces(log)[..., :2])
    gain = told[..., 2] / forces(log)[..., 2]
    np.testing.assert_allclose(gain[:, 1, 2], np.linspace(1.0, 0.5, FRAMES), rtol=1e-12)


def test_late_forces_are_those_of_before_and_at_first_the_first(log: GraspLog) -> None:
    told = forces(seen(faults.late(0.035), log))
    np.testing.assert_array_equal(told[4:], forces(log)[:-4])  # the last frame that is 35 ms old, of one each 10 ms
    np.testing.assert_array_equal(told[:4], forces(log)[[0] * 4])
    np.testing.assert_array_equal(forces(seen(faults.late(0.0), log)), forces(log))
    assert seen(faults.late(0.035), replace(log, force=None)).force is None


def test_stuck_forces_and_crosstalk(log: GraspLog) -> None:
    told = faults.stuck(forces(log))
    np.testing.assert_array_equal(told[:200], forces(log)[:200])
    np.testing.assert_array_equal(told[200:], forces(log)[[200] * 200])
    crossed = forces(seen(faults.crosstalk(0.1), log)) - forces(log)
    np.testing.assert_allclose(crossed[..., 0], 0.1 * forces(log)[..., 2], rtol=0.0, atol=1e-18)
    assert not crossed[..., 1:].any()
    assert seen(faults.crosstalk(0.1), replace(log, force=None)).force is None


def test_dropped_frames_leave_the_others_in_their_order(log: GraspLog) -> None:
    left = seen(faults.dropped(0.25), log)
    assert len(left) == 300
    at = np.searchsorted(log.time, left.time)
    assert (np.diff(at) > 0).all()
    np.testing.assert_array_equal(left.displacement, log.displacement[at])


def test_on_a_dome_each_force_is_turned_away_from_the_middle_and_stays_as_large(log: GraspLog) -> None:
    """About the axis that is square to its way out, by an angle in proportion to its distance (Rodrigues)."""
    told = forces(seen(faults.dome_forces(20.0), log))
    np.testing.assert_allclose(np.linalg.norm(told, axis=-1), np.linalg.norm(forces(log), axis=-1), rtol=1e-12)
    middle = (SIDE - 1) / 2
    for row, column in ((0, 0), (1, 3), (2, 4), (4, 1)):
        way = np.array([row - middle, column - middle])
        tilt = np.radians(20.0) * np.hypot(*way) / np.hypot(middle, middle)
        x, y = way / np.hypot(*way)
        out, up = np.array([x, y, 0.0]), np.array([0.0, 0.0, 1.0])
        before = forces(log)[:, row, column]
        radial, normal = before @ out, before @ up
        turned = np.outer(np.cos(tilt) * radial + np.sin(tilt) * normal, out)
        turned += np.outer(np.cos(tilt) * normal - np.sin(tilt) * radial, up)
        turned += np.outer(before @ np.cross(up, out), np.cross(up, out))
        np.testing.assert_allclose(told[:, row, column], turned, rtol=0.0, atol=1e-15)
    np.testing.assert_array_equal(told[:, 2, 2], forces(log)[:, 2, 2])
