"""Where a patch lies among the markers, and how an object moves over them, against closed forms."""

import numpy as np
import pytest
from numpy.typing import NDArray

from slipcore.defaults import PatchOptions
from slipcore.frames import GraspLog
from slipcore.patch.motion import motion_over_markers
from slipcore.patch.pose import lattice_pose
from tests.slipcore.patch.spans import one_patch

PITCH = 1e-3
AXIS = PITCH * (np.arange(31) - 15.0)
POSITION = np.stack([*np.meshgrid(AXIS, AXIS, indexing="ij"), np.zeros((31, 31))], axis=-1)
ROUND = 0.3

Field = NDArray[np.float64]


def pose_of(weight: Field, least_anisotropy: float = ROUND) -> tuple[Field, Field]:
    """Of a patch of all elements."""
    return lattice_pose(one_patch(np.ones(weight.shape, bool)), weight, POSITION, least_anisotropy)


def ellipse(yaw: float, axes: tuple[float, float] = (3e-3, 1.5e-3), centre: tuple[float, float] = (0.0, 0.0)) -> Field:
    """Gaussian pressure [n, m] of these standard deviations m, the first along ``yaw``."""
    x, y = POSITION[..., 0] - centre[0], POSITION[..., 1] - centre[1]
    along, across = x * np.cos(yaw) + y * np.sin(yaw), y * np.cos(yaw) - x * np.sin(yaw)
    return np.exp(-0.5 * ((along / axes[0]) ** 2 + (across / axes[1]) ** 2))


def test_a_rectangle_has_its_centre_axis_and_radius_of_gyration() -> None:
    """Of a × b points a pitch apart the mean squares about the centre are (a² − 1)/12 and (b² − 1)/12 pitches²."""
    weight = np.zeros((1, 31, 31))
    weight[0, 3:12, 20:23] = 2.0
    pose, gyration = pose_of(weight)
    np.testing.assert_allclose(pose[0], [AXIS[7], AXIS[21], 0.0], rtol=1e-9, atol=1e-12)
    assert gyration[0] == pytest.approx(PITCH * np.sqrt((9**2 - 1 + 3**2 - 1) / 12.0), rel=1e-9)


def test_the_axis_is_followed_through_a_whole_turn() -> None:
    yaw = np.linspace(0.1, 0.1 + 2.0 * np.pi, 60)
    weight = np.stack([ellipse(angle) for angle in yaw])
    np.testing.assert_allclose(pose_of(weight)[0][:, 2], yaw, atol=1e-3)


def test_a_round_patch_has_no_direction_and_none_has_no_place() -> None:
    weight = np.stack([ellipse(0.4, axes=(3e-3, 3e-3)), np.zeros((31, 31))])
    pose, gyration = pose_of(weight)
    assert np.isnan(pose[0, 2])
    assert np.isfinite(pose[0, :2]).all()
    assert np.isnan(pose[1]).all()
    assert np.isnan(gyration[1])


def test_a_single_element_has_no_direction_by_rounding_either() -> None:
    weight = np.zeros((9, 31, 31))
    weight[np.arange(9), np.arange(9), 20] = 0.1 * np.arange(1.0, 10.0)
    pose, gyration = pose_of(weight)
    np.testing.assert_allclose(pose[:, :2], POSITION[np.arange(9), 20, :2], rtol=1e-12)
    assert np.isnan(pose[:, 2]).all()
    assert (gyration == 0.0).all()


def test_markers_that_turn_with_the_object_are_not_moved_over() -> None:
    """v = v₀ + ω × r of the object at the patch less that of its markers; what they do together is no slip."""
    time = 0.02 * np.arange(60.0)
    spin, slide = 0.2, 1e-3
    pose = np.column_stack([slide * time, np.zeros(60), spin * time])
    weight = np.broadcast_to(ellipse(0.3, (2e-3, 2e-3), (4e-3, -2e-3)), (60, 31, 31))
    x, y = POSITION[..., 0], POSITION[..., 1]
    still = np.zeros((60, 31, 31, 3))
    carried = still.copy()
    for k, (dx, _, angle) in enumerate(pose):
        carried[k, ..., 0] = dx + np.cos(angle) * x - np.sin(angle) * y - x
        carried[k, ..., 1] = np.sin(angle) * x + np.cos(angle) * y - y
    options, (lattice, gyration), spans = PatchOptions(), pose_of(weight), one_patch(np.ones(weight.shape, bool))
    logs = (GraspLog(time, POSITION, moved, PITCH**2, object_pose=pose) for moved in (carried, still))
    stuck, slipping = (motion_over_markers(log, spans, weight, lattice, gyration, options) for log in logs)
    inner = slice(13, -13)  # with a whole window around them
    np.testing.assert_allclose(stuck.speed[inner], 0.0, atol=2e-6)
    assert not stuck.travels[inner].any()
    assert not stuck.turns[inner].any()
    arm = np.array([4e-3, -2e-3]) - pose[:, :2]
    expected = np.column_stack([slide - spin * arm[:, 1], spin * arm[:, 0]])
    np.testing.assert_allclose(slipping.velocity[inner], expected[inner], rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(slipping.turning, spin * gyration, rtol=1e-6)
    assert slipping.travels.all()
    assert slipping.turns.all()
    assert not slipping.wanders.any()
