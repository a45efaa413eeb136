import numpy as np
import pytest

from slipcore.detection.shared.decision import apply_decision
from slipcore.detection.shared.records import Decision, FrameArrays, Memory, unwritten
from slipcore.detection.shared.rigid_motion import fit_motion

SHAPE = (4, 5)
RNG = np.random.default_rng(3)
ROW, COLUMN = np.meshgrid(np.arange(4.0), np.arange(5.0), indexing="ij")
POSITION = 1e-3 * np.stack([ROW, COLUMN, 0 * ROW], axis=-1)
START = 1e-4 * RNG.standard_normal((*SHAPE, 3))
NO_POSE, NO_FIELD, NO_MASK = np.zeros(0), np.zeros((0, 0, 3)), np.zeros((0, 0), bool)
NO_MEMORY = np.zeros((0, 0)), np.zeros((0, 0, 0)), np.zeros(0)


def carried(displacement: np.ndarray, angle: float, shift: tuple[float, float]) -> np.ndarray:
    """Displacement after a rigid motion of the displaced points about the origin."""
    c, s = np.cos(angle), np.sin(angle)
    after = displacement.copy()
    after[..., :2] = (POSITION + displacement)[..., :2] @ np.array([[c, s], [-s, c]]) + shift - POSITION[..., :2]
    return after


def said(end: np.ndarray, slips: np.ndarray, poses: tuple[np.ndarray, np.ndarray] = (NO_POSE, NO_POSE)) -> tuple:
    contact, nothing, likely = np.ones(SHAPE, bool), np.zeros(SHAPE, bool), slips.astype(float)
    contact[0, 0] = False
    was = contact.copy()
    was[1, 1] = False
    last, frame = (
        unwritten(FrameArrays(time, displacement, NO_FIELD, pose, NO_FIELD, NO_MASK))
        for time, displacement, pose in ((0.0, START, poses[0]), (0.1, end, poses[1]))
    )
    before = Memory(was, nothing, likely * 0.0, *NO_MEMORY)
    after = Memory(contact, np.empty(SHAPE, bool), np.empty(SHAPE), *NO_MEMORY)
    velocity = np.empty((*SHAPE, 2))
    counts = apply_decision(POSITION, last, frame, Decision(slips, likely), before, after, np.empty(SHAPE), velocity)
    return *counts, after.slip, after.probability, velocity


def test_velocity_is_relative_to_what_sticks_and_unknown_of_what_has_just_touched() -> None:
    slips = np.zeros(SHAPE, bool)
    slips[2:] = True
    end = carried(START, 0.01, (1e-4, -2e-5))
    end[2, 2, 0] += 3e-5
    touching, slipping, slip, probability, velocity = said(end, slips)
    assert (touching, slipping) == (19, 10)
    np.testing.assert_array_equal(slip, slips)
    np.testing.assert_array_equal(probability, slips)
    assert np.isnan(velocity[0, 0]).all()
    assert np.isnan(velocity[1, 1]).all()
    expected = np.zeros((*SHAPE, 2))
    expected[2, 2, 0] = 3e-4
    known = np.isfinite(velocity)
    np.testing.assert_allclose(velocity[known], expected[known], rtol=0, atol=1e-15)  # rounding of mm over 0.1 s


def test_a_known_pose_takes_the_place_of_what_sticks() -> None:
    before, after = np.array([1e-3, 2e-3, 0.4]), np.array([1.3e-3, 1.9e-3, 0.45])
    turn, (x, y) = 0.05, before[:2]
    c, s = np.cos(turn), np.sin(turn)
    shift = after[:2] - [c * x - s * y, s * x + c * y]
    velocity = said(carried(START, turn, tuple(shift)), np.ones(SHAPE, bool), (before, after))[-1]
    known = np.isfinite(velocity)
    assert np.count_nonzero(known) == 36
    np.testing.assert_allclose(velocity[known], 0.0, rtol=0, atol=1e-14)


def test_velocity_is_unobservable_where_all_slip_and_the_object_is_unknown() -> None:
    touching, slipping, *_, velocity = said(START, np.ones(SHAPE, bool))
    assert touching == slipping + 1  # one has just touched
    assert np.isnan(velocity).all()


@pytest.mark.parametrize("count", [0, 1])
def test_fewer_than_two_points_tell_no_motion(count: int) -> None:
    weight = np.zeros(SHAPE)
    weight.flat[:count] = 1.0
    assert np.isnan(fit_motion(POSITION, START, START, weight)).all()
