"""How far a soft object's surface follows its body, by hand, as plain Python."""

import math
from inspect import unwrap

import numpy as np
import pytest

from slipcore.defaults import FilterOptions
from slipcore.detection.filter.pose import Anchors, PoseVariance, between, pose_at
from slipcore.detection.filter.pose_noise import PoseNoise
from slipcore.detection.filter.state import COMMON, FOLLOWING
from slipcore.detection.filter.surface_motion import (
    body_motion,
    following_share,
    learn_following,
    store_pose,
    stored_pose,
)
from slipcore.detection.filter.tuning import Tuning, settings_of

TUNING = Tuning(*settings_of(FilterOptions()))._replace(
    following_whole=0.9, following_deviations=2.0, following_weight=8.0, following_learning=0.5, following_stick=0.7,
    following_variance=0.25,
)  # fmt: skip


def anchors(stick: float = 1.0) -> Anchors:
    """Three whose markers have (2, 4) for their centre."""
    made = Anchors(*np.zeros((8, 3)))
    made.marker_x[:], made.marker_y[:], made.stick[:] = [1.0, 2.0, 3.0], [4.0, 4.0, 4.0], stick
    return made


def test_a_pose_is_stored_and_read_again() -> None:
    common = np.zeros(COMMON)
    unwrap(store_pose)(common, 5, pose_at(1.0, 2.0, 0.3, 1.1))
    assert common[4:10].tolist() == [0.0, 1.0, 2.0, 0.3, 1.1, 0.0]
    assert unwrap(stored_pose)(common, 5) == (1.0, 2.0, 0.3, 1.1, math.cos(0.3), math.sin(0.3))


def test_a_body_carries_its_centre_along_and_around() -> None:
    """A turn by 0.1 about (1, 1), from where the centre lies 1 to the right and 3 above."""
    carried = unwrap(body_motion)(anchors(), np.array([1.0, 1.0, 0.0]), np.array([0.5, -0.5, 0.1]))
    assert carried == pytest.approx((2.0, 4.0, 0.5 - 0.3, -0.5 + 0.1))


@pytest.mark.parametrize(
    ("sums", "share"),
    [((0.0, 0.0), 1.0), ((10.0, 20.0), 0.5), ((91.0, 100.0), 1.0), ((80.0, 99.0), 1.0), ((80.0, 102.0), 80.0 / 102.0)],
)
def test_the_share_counts_where_it_is_clearly_less_than_all(sums: tuple[float, float], share: float) -> None:
    """Two deviations: about (1 − 0.8)² times 100."""
    common = np.zeros(COMMON)
    common[FOLLOWING : FOLLOWING + 2] = sums
    assert unwrap(following_share)(common, TUNING) == pytest.approx(share)


def learnt(stick: float = 1.0, known: bool = True, before: float = 0.0, way: float = 1.5) -> np.ndarray:
    """What a step adds of which the body's is (3, 0), and the surface's a way along it; places without noise."""
    common = np.zeros(COMMON)
    common[FOLLOWING + 1] = before
    poses = pose_at(0.0, 0.0, 0.0, 1.0), pose_at(way, 0.7, 0.0, 1.0)
    noise, spread = PoseNoise(0.0, 0.0, known), PoseVariance(0.0, 0.0, 0.0, 0.0)
    unwrap(learn_following)(anchors(stick), *poses, spread, (2.0, 4.0, 3.0, 0.0), noise, TUNING, common)
    return common[FOLLOWING : FOLLOWING + 2] - [0.0, before]


def test_a_step_tells_by_its_own_size_how_far_the_surface_follows() -> None:
    """f · d over d², each over a quarter of d²: 4.5 and 9 over 2.25."""
    np.testing.assert_allclose(learnt(), [2.0, 4.0], rtol=1e-9)


def test_nothing_is_learnt_without_noise_backwards_or_once_much_slips() -> None:
    assert not learnt(known=False).any()
    assert not learnt(way=-0.1).any()
    assert learnt(stick=0.6).any()  # it begins
    assert not learnt(stick=0.6, before=4.1).any()  # more than half of 8
    assert learnt(stick=0.8, before=4.1).any()


def test_between_two_poses_the_shorter_way_round() -> None:
    found = unwrap(between)(pose_at(0.0, 2.0, 3.0, 1.0), pose_at(4.0, 0.0, -3.0, 1.2), 0.25)
    assert found[:4] == pytest.approx((1.0, 1.5, 3.0 + 0.25 * (2.0 * math.pi - 6.0), 1.05))
