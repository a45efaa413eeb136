"""Whether pose and load lie off their means, by hand, as plain Python."""

from inspect import unwrap

import numpy as np
import pytest

from slipcore.defaults import FilterOptions
from slipcore.detection.filter.hold import changed, load_of, moved
from slipcore.detection.filter.pose import Anchors, PoseVariance, pose_at
from slipcore.detection.filter.state import COMMON, HELD_FRAMES, HELD_LOAD, HELD_POSE
from slipcore.detection.filter.tuning import Tuning, settings_of
from slipcore.detection.shared.records import FrameArrays

TUNING = Tuning(*settings_of(FilterOptions()))._replace(
    hold_deviations=4.0, ratio_least_force=0.3, displacement_floor=0.0
)
DISPLACEMENT = np.arange(18.0).reshape(2, 3, 3)
FRAME = FrameArrays(0.0, DISPLACEMENT, 0.1 * DISPLACEMENT, np.zeros(0), DISPLACEMENT, np.ones((2, 3), bool))


def held(frames: float, *load: float) -> np.ndarray:
    """Means of so many frames: a pose at the origin, and a load."""
    common = np.zeros(COMMON)
    common[HELD_FRAMES], common[HELD_POSE + 3] = frames, 1.0
    common[HELD_LOAD : HELD_LOAD + 3] = load or (0.0, 0.0, 0.0)
    return common


def test_a_load_is_the_sum_of_forces_or_of_depths() -> None:
    """Sums of 0, 3, …, 15 and so on over six elements; deviations of 0.2 N and 3 m each."""
    load, variance = unwrap(load_of)(FRAME, True, 9.0, 0.2, TUNING)
    np.testing.assert_allclose(load, (4.5, 5.1, 5.7))
    assert variance == pytest.approx(6.0 * 0.04 + 0.09)
    assert unwrap(load_of)(FRAME, False, 9.0, 0.2, TUNING) == ((0.0, 0.0, 57.0), pytest.approx(54.0))


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize(("off", "has_changed"), [(4.4, False), (4.6, True), (-4.6, True)])
def test_a_load_changes_beyond_four_deviations_of_a_difference_from_a_mean_of_four(
    axis: int, off: float, has_changed: bool
) -> None:
    """4 √(1 + 1/4) = 4.47 deviations, of 0.1 N."""
    load = [1.0, 2.0, 3.0]
    load[axis] += 0.1 * off
    assert unwrap(changed)(tuple(load), 0.01, TUNING, held(4.0, 1.0, 2.0, 3.0)) == has_changed


@pytest.mark.parametrize(("way", "has_moved"), [(4.4e-6, False), (4.6e-6, True)])
@pytest.mark.parametrize("axis", [0, 1])
def test_a_pose_moves_beyond_four_deviations_from_its_mean(axis: int, way: float, has_moved: bool) -> None:
    """A place to 1 µm along both axes together, and a yaw that is known."""
    x, y = np.array([1e-3, -1e-3]), np.array([2e-3, 2e-3])
    anchors = Anchors(x, y, *np.zeros((6, 2)))
    place = [0.0, 0.0]
    place[axis] = way
    pose = pose_at(place[0], place[1], 0.0, 1.0)
    assert unwrap(moved)(anchors, pose, PoseVariance(1e-12, 0.0, 0.0, 0.0), TUNING, held(4.0)) == has_moved


def test_a_yaw_that_is_unsure_moves_what_lies_far_from_the_middle_of_the_fit() -> None:
    """Anchors 2 mm from it, unsure by 1 mrad: 2 µm each."""
    x = np.array([3e-3, -1e-3])
    anchors = Anchors(x, np.zeros(2), *np.zeros((6, 2)))
    for way, has_moved in ((8.8e-6, False), (9.1e-6, True)):  # 4 √1.25 · 2 µm = 8.94 µm
        pose = pose_at(0.0, way, 0.0, 1.0)
        spread = PoseVariance(0.0, 1e-6, 1e-3, way)
        assert unwrap(moved)(anchors, pose, spread, TUNING, held(4.0)) == has_moved
