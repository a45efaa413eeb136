"""How sums of forces and of displacement change, reckoned by hand; see test_contradicting_forces for whole logs."""

from dataclasses import replace

import numpy as np
import pytest

from slipcore import GraspLog
from slipcore.detection.contradicting_forces import (
    Changes,
    _is_clear,
    _leaves_the_lattice,
    agreeing,
    brought_forward,
    changes_of,
    crosstalk_of,
    lag_of_forces,
    slow_changes_of,
    unexplained,
)

STEP = 0.1


def changes(displacement: np.ndarray, force: np.ndarray) -> Changes:
    return Changes(STEP, displacement, force)


def jumps(seed: int = 0, count: int = 60) -> np.ndarray:
    """Changes [k, 4] that no other time has."""
    return np.random.default_rng(seed).standard_normal((count, 4))


def growing(displacement: list[float], force: list[float], frames: int = 24) -> GraspLog:
    """Both grow evenly by so much a second, on 2 × 2 elements of 1 mm, at 60 frames a second."""
    time = np.arange(frames) / 60.0
    row, column = np.mgrid[:2, :2]
    grown = [time[:, None, None, None] * np.broadcast_to(each, (frames, 2, 2, 3)) for each in (displacement, force)]
    return GraspLog(time, 1e-3 * np.stack([row, column, 0 * row], axis=-1), grown[0], 1e-6, force=grown[1])


def test_sums_change_by_their_rate_times_the_step() -> None:
    """Of four elements; forces that turn about the middle, half a pitch each way, add up to a moment alone."""
    log = growing([1e-4, 2e-4, -3e-4], [0.1, -0.2, 0.3])
    turning = np.array([[[0.5, -0.5], [-0.5, -0.5]], [[0.5, 0.5], [-0.5, 0.5]]]) * log.time[:, None, None, None]
    force = np.array(log.force)
    force[..., :2] += turning
    found = changes_of(replace(log, force=force))
    step = 1.0 / 60.0
    assert found.step == pytest.approx(step, rel=1e-12)
    assert found.displacement.shape == (21, 4)
    np.testing.assert_allclose(found.displacement[:, :3], 4.0 * step * np.array([[1e-4, 2e-4, -3e-4]] * 21), rtol=1e-9)
    arm = 0.5e-3 * np.sqrt(2.0)  # of each element, and so the radius of gyration
    moment = 4.0 * 0.5 * np.sqrt(2.0) * arm / arm
    np.testing.assert_allclose(
        found.force, step * np.array([[0.4, -0.8, 1.2, moment]] * 21), rtol=1e-9, err_msg="rounding"
    )


def test_a_mean_over_two_steps_smooths_what_changes_within_them() -> None:
    """A jump of one force by 1 N is spread evenly over the two steps of the mean; all of it is there."""
    log = growing([1e-4, 0.0, 0.0], [0.0, 0.0, 0.0])
    force = np.zeros((24, 2, 2, 3))
    force[12:, 0, 0, 2] = 1.0
    jump = changes_of(replace(log, force=force)).force[:, 2]
    assert jump.sum() == pytest.approx(1.0, rel=1e-9)
    assert np.count_nonzero(np.abs(jump) > 1e-9) == 3  # half a frame on either side
    assert jump.max() == pytest.approx(0.5, rel=1e-9)


@pytest.mark.parametrize(("gap", "is_empty"), [(1.4, False), (1.7, True)])
def test_a_log_of_which_most_is_gaps_has_no_changes(gap: float, is_empty: bool) -> None:
    """24 frames of 1/60 s may stand for at most 96 steps, that is 1.6 s in all."""
    log = growing([1e-4, 0.0, 0.0], [0.1, 0.0, 0.0])
    time = log.time.copy()
    time[-1] = gap
    found = changes_of(replace(log, time=time))
    assert (len(found.force) == 0) == is_empty
    assert len(found.force) == len(found.displacement)


def test_of_forces_that_go_with_displacement_nothing_is_unexplained() -> None:
    """Each of three stiffnesses is its own; one for both axes along the surface."""
    moved = jumps()
    assert unexplained(moved, moved * [2.0, 2.0, 5.0, 7.0]) == pytest.approx(0.0, abs=1e-12)
    assert unexplained(moved, -moved) == pytest.approx(1.0, rel=1e-12)  # no stiffness is below 0
    assert unexplained(moved, np.zeros_like(moved)) == 0.0
    assert unexplained(np.zeros_like(moved), moved) == pytest.approx(1.0, rel=1e-12)


def test_the_share_that_is_unexplained_is_that_of_the_residual() -> None:
    """Force (1, 2) by displacement (1, 0) along x: stiffness 1, which leaves 4 of 5."""
    moved, pushed = np.zeros((2, 4)), np.zeros((2, 4))
    moved[:, 0], pushed[:, 0] = [1.0, 0.0], [1.0, 2.0]
    assert unexplained(moved, pushed) == pytest.approx(0.8, rel=1e-12)


@pytest.mark.parametrize(("lag", "found"), [(0, 0.0), (1, 0.1), (7, 0.7), (10, 1.0), (11, 0.0), (-3, -0.3)])
def test_a_lag_is_found_up_to_a_second_and_below_0_of_early_forces(lag: int, found: float) -> None:
    moved = jumps(count=80)
    assert lag_of_forces(changes(moved, 3.0 * np.roll(moved, lag, axis=0))) == pytest.approx(found, abs=1e-12)


def test_a_lag_is_sought_within_a_third_of_the_log() -> None:
    moved = jumps(count=24)
    assert lag_of_forces(changes(moved, np.roll(moved, 8, axis=0))) == pytest.approx(0.8, rel=1e-12)
    assert lag_of_forces(changes(moved, np.roll(moved, 9, axis=0))) == 0.0


def test_no_lag_is_taken_that_leaves_three_tenths_unexplained() -> None:
    moved, noise = jumps(count=400), jumps(seed=1, count=400)
    for size, found in ((0.6, 0.5), (0.7, 0.0)):  # 0.36 of 1.36 is left, and 0.49 of 1.49
        pushed = np.roll(moved, 5, axis=0) + size * noise
        assert lag_of_forces(changes(moved, pushed)) == pytest.approx(found, abs=1e-12)


@pytest.mark.parametrize(("alike", "found"), [(0.85, 0.2), (0.93, 0.0)])
def test_no_lag_is_taken_of_several_that_leave_a_tenth_more_at_most(alike: float, found: float) -> None:
    """A load that comes again after eight steps, most of it alike: lags of −0.6 and 1 s leave the rest."""
    moved = jumps(count=4000)
    for k in range(8, 4000):
        moved[k] = np.sqrt(alike) * moved[k - 8] + np.sqrt(1.0 - alike) * moved[k]
    assert lag_of_forces(changes(moved, np.roll(moved, 2, axis=0))) == pytest.approx(found, abs=1e-12)


@pytest.mark.parametrize(
    ("before", "left", "clear"),
    [(0.9, 0.44, True), (0.9, 0.46, False), (0.08, 0.035, False), (0.08, 0.025, True), (0.06, 0.02, False)],
)
def test_a_fault_is_clear_that_halves_what_is_left_and_explains_a_twentieth(
    before: float, left: float, clear: bool
) -> None:
    assert _is_clear(before, left) == clear


def test_forces_brought_forward_are_those_of_the_frame_next_to_that_time() -> None:
    log = growing([1e-4, 0.0, 0.0], [0.0, 0.0, -1.0])
    assert log.force is not None
    forward = brought_forward(log, 2.4 / 60.0)
    assert forward.force is not None
    np.testing.assert_array_equal(forward.force[:-2], log.force[2:])
    np.testing.assert_array_equal(forward.force[-2:], log.force[[-1, -1]])
    np.testing.assert_array_equal(brought_forward(log, 2.6 / 60.0).force[0], log.force[3])


def leaking(leak: tuple[float, float]) -> Changes:
    """Along each axis 2 N/m of the displacement and a share of what presses, which has a displacement of its own."""
    moved = jumps(count=200)
    force = 2.0 * moved
    force[:, :2] -= np.multiply.outer(force[:, 2], leak)
    return changes(moved, force)


@pytest.mark.parametrize("leak", [(0.5, 0.0), (0.0, -0.5), (0.4, 0.3)])
def test_crosstalk_is_the_share_of_normal_force_that_appears_sideways(leak: tuple[float, float]) -> None:
    np.testing.assert_allclose(crosstalk_of(leaking(leak)), leak, rtol=1e-9, atol=1e-9)


def test_little_crosstalk_and_that_of_one_with_the_normal_force_is_none() -> None:
    assert not crosstalk_of(leaking((0.03, 0.03))).any()
    moved = jumps(count=200)
    moved[:, 0] += 1.5 * moved[:, 2]  # squared correlation of 2.25 of 3.25
    force = 2.0 * moved
    force[:, 0] -= 0.4 * force[:, 2]
    assert not crosstalk_of(changes(moved, force)).any()
    moved[:, 1] = 0.0  # and without displacement along one axis nothing is known
    assert not crosstalk_of(changes(moved, force)).any()


def test_steps_grow_until_displacement_is_little_noise() -> None:
    log = growing([1e-4, 1e-4, -1e-4], [0.1, 0.1, -0.1], frames=200)
    assert slow_changes_of(log).step == pytest.approx(1.0 / 60.0, rel=1e-12)
    noise = 3e-6 * np.random.default_rng(2).standard_normal(log.displacement.shape)
    slow = slow_changes_of(replace(log, displacement=log.displacement + noise))
    power = np.log(60.0 * slow.step) / np.log(1.5)
    assert power == pytest.approx(round(power), abs=1e-9)
    assert 0 < power < 6
    assert len(slow_changes_of(replace(log, displacement=100.0 * noise)).force) == 0


@pytest.mark.parametrize(("rim", "leaves"), [(0.012, False), (0.015, True)])
def test_a_contact_leaves_the_lattice_of_which_the_rim_bears_a_tenth(rim: float, leaves: bool) -> None:
    """Eight elements around one that bears 1 N."""
    force = np.zeros((3, 3, 3, 3))
    force[..., 2] = -rim
    force[:, 1, 1, 2] = -1.0
    row, column = np.mgrid[:3, :3]
    position = 1e-3 * np.stack([row, column, 0 * row], axis=-1)
    log = GraspLog(np.arange(3) / 60.0, position, np.zeros_like(force), 1e-6, force=force)
    assert _leaves_the_lattice(log) == leaves


@pytest.mark.parametrize(("frames", "is_mended"), [(70, True), (11, False)])
def test_late_forces_are_told_in_seconds(frames: int, is_mended: bool) -> None:
    log = growing([1e-4, 0.0, -1e-4], [0.0, 0.0, 0.0], frames=frames)
    path = np.cumsum(jumps(count=frames)[:, :3], axis=0)[:, None, None]
    force = np.concatenate([np.repeat(path[:1], 4, axis=0), path[:-4]])
    moved = np.broadcast_to(1e-5 * path, log.displacement.shape)
    pushed = np.broadcast_to(1e-2 * force, log.displacement.shape)
    _, findings = agreeing(replace(log, displacement=moved, force=pushed))
    told = [each.evidence for each in findings if each.name == "late forces"]
    assert len(told) == is_mended
    assert all(each.startswith("forces come 0.07 s after the displacement") for each in told)
