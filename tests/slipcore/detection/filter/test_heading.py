"""Which way the object moves over an element, and whether its force points against that."""

import math
from inspect import unwrap

import numpy as np
import pytest

from slipcore.detection.filter.heading import follow_headings
from slipcore.detection.filter.pose import AnchorMotion, pose_at
from slipcore.detection.filter.state import HEADING_X, HEADING_Y, OPPOSED, ROWS

LENGTH, GAIN = 5e-6, 0.5
PLACE = np.array([[0, 0]])


def followed(steps: list[float], force: tuple[float, float], yaw: float = 0.0, length: float = LENGTH) -> np.ndarray:
    """State of one element after motion along the object's x, m each, under a force."""
    after, forces = np.zeros((ROWS, 1, 1)), np.array([[[*force, -1.0]]])
    for step in steps:
        before, after = after, np.full((ROWS, 1, 1), 9.0)
        motion = AnchorMotion(np.array([step]), np.zeros(1), np.zeros(1))
        unwrap(follow_headings)(before, PLACE, motion, pose_at(0.0, 0.0, yaw, 1.0), forces, length, GAIN, after)
    return np.asarray(after[:, 0, 0])


def test_the_heading_is_a_mean_over_motion_and_not_over_frames() -> None:
    one, many = followed([LENGTH], (1.0, 0.0)), followed([LENGTH / 10.0] * 10, (1.0, 0.0))
    assert one[HEADING_X] == pytest.approx(1.0 - math.exp(-1.0))
    np.testing.assert_allclose(many, one)
    still = followed([LENGTH, 0.0, 0.0], (1.0, 0.0))
    assert still[HEADING_X] == one[HEADING_X]


def test_a_force_opposes_the_motion_once_that_has_turned_back_for_long_enough() -> None:
    away = [10.0 * LENGTH]
    assert not followed(away, (1.0, 0.0))[OPPOSED]
    assert not followed([*away, -0.1 * LENGTH], (1.0, 0.0))[OPPOSED]
    assert followed([*away, -LENGTH], (1.0, 0.0))[OPPOSED]
    assert not followed([*away, -LENGTH], (-1.0, 0.0))[OPPOSED]


def test_motion_is_that_of_the_object_and_force_that_on_the_sensor() -> None:
    """Of an object that is turned by a quarter, its x is the sensor's y."""
    found = followed([10.0 * LENGTH], (5.0, -0.1), 0.5 * math.pi)
    assert found[HEADING_Y] == pytest.approx(1.0, abs=1e-4)
    assert found[OPPOSED] == pytest.approx(2.0)


def test_without_a_length_motion_or_forces_nothing_is_opposed() -> None:
    assert not followed([LENGTH], (-1.0, 0.0), length=0.0)[[HEADING_X, HEADING_Y, OPPOSED]].any()
    assert not followed([0.0], (-1.0, 0.0))[OPPOSED]
    after, motion = np.zeros((ROWS, 1, 1)), AnchorMotion(np.array([LENGTH]), np.zeros(1), np.zeros(1))
    pose = pose_at(0.0, 0.0, 0.0, 1.0)
    unwrap(follow_headings)(np.zeros((ROWS, 1, 1)), PLACE, motion, pose, np.zeros((0, 0, 0)), LENGTH, GAIN, after)
    assert after[HEADING_X, 0, 0] > 0.0
    assert not after[OPPOSED].any()


def test_a_force_against_the_motion_counts_as_far_as_there_is_motion_within_the_memory_of_forces() -> None:
    turned = [10.0 * LENGTH, -LENGTH]
    for moved, counts in ((1.0, 1.0 - math.exp(-2.0)), (0.01, 0.0198), (0.0, 0.0)):
        found = followed([*turned, -moved * LENGTH], (1.0, 0.0))
        assert found[OPPOSED] == pytest.approx(1.0 + counts, rel=1e-4)
