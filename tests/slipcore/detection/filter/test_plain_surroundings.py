"""Motion of the surroundings and pooled places as plain Python, by hand."""

from inspect import unwrap

import numpy as np
import pytest

from slipcore import FilterOptions
from slipcore.detection.filter import pooling, surroundings
from slipcore.detection.filter.pose import Anchors, Pose
from slipcore.detection.filter.state import BEND, COMMON, JITTER, SHAKING, SHIFT, STEP
from slipcore.detection.filter.tuning import Tuning, settings_of
from slipcore.detection.shared.records import NO_FIELD, NO_POSE, FrameArrays
from tests.slipcore.plain_kernels import as_plain_python

TUNING = Tuning(*settings_of(FilterOptions()))._replace(
    surroundings_reach=2.0, surroundings_least=8, surroundings_memory=4.0, surroundings_outlier=3.0
)


@pytest.fixture(autouse=True)
def plain(monkeypatch: pytest.MonkeyPatch) -> None:
    as_plain_python(monkeypatch, surroundings, pooling)


def test_steps_are_those_of_markers_at_the_distance_or_farther() -> None:
    before, now = np.zeros((2, 3, 3)), np.arange(18.0).reshape(2, 3, 3)
    distance, steps = np.array([[0.0, 1.0, 2.0], [1.0, 1.4, 2.4]]), np.zeros((3, 6))
    before[0, 2] = 0.5
    assert surroundings.find_steps(before, now, distance, 1.4, steps) == 3
    np.testing.assert_array_equal(steps[:2, :3], [[5.5, 12.0, 15.0], [6.5, 13.0, 16.0]])


def test_a_middle_comes_with_the_median_of_what_is_off_it() -> None:
    room = np.zeros(5)
    assert surroundings.middle_and_spread(np.array([4.0, 1.0, 2.0, 9.0, 2.5]), room) == (2.5, 1.5)


def test_what_is_off_in_either_direction_is_left_out_of_the_usual_step() -> None:
    steps = np.zeros((3, 6))
    steps[0] = [1.0, 2.0, 3.0, 2.0, 2.0, 40.0]
    steps[1] = [-1.0, 0.0, 1.0, 0.0, 30.0, 0.0]
    assert surroundings.usual_step(steps, 0.0) == (2.0, 0.0)
    steps[0], steps[1] = [1.0, 2.0, 3.0, 4.0, 5.0, 99.0], [0.0, 1.0, 0.0, 1.0, 2.0, 0.0]
    assert surroundings.usual_step(steps, 3.0) == (3.0, 0.8)


def test_where_all_are_off_in_one_direction_the_middle_is_the_step() -> None:
    steps = np.array([[0.0, 1.0, 2.0], [3.0, 0.0, 5.0], [0.0, 0.0, 0.0]])
    assert surroundings.usual_step(steps, 0.0) == (1.0, 3.0)


def test_jitter_is_told_by_changes_of_the_step_that_turn_back() -> None:
    common = np.zeros(COMMON)
    surroundings.add_step(2.0, 1.0, TUNING, common)
    assert surroundings.share_of_jitter(TUNING, common) == 0.0
    np.testing.assert_array_equal(common[STEP : STEP + 2], [2.0, 1.0])
    np.testing.assert_array_equal(common[BEND : BEND + 2], [2.0, 1.0])
    np.testing.assert_array_equal(common[JITTER : JITTER + 2], [5.0, 0.0])
    surroundings.add_step(1.0, 0.0, TUNING, common)
    np.testing.assert_array_equal(common[BEND : BEND + 2], [-1.0, -1.0])
    np.testing.assert_array_equal(common[JITTER : JITTER + 2], [0.75 * 5.0 + 2.0, -3.0])
    assert surroundings.share_of_jitter(TUNING, common) == pytest.approx(1.5 * 3.0 / 5.75, rel=1e-9)


@pytest.mark.parametrize(
    ("squares", "products", "least", "expected"),
    [
        (48e-12, -30e-12, 0.5e-12, True),
        (48e-12, -30e-12, 1e-12, True),
        (48e-12, -30e-12, 1.05e-12, False),
        (48e-12, -15e-12, 0.5e-12, False),  # mostly an even motion
        (0.0, 0.0, 0.5e-12, False),
    ],
)
def test_markers_jitter_together_where_most_of_their_motion_does_and_by_enough(
    squares: float, products: float, least: float, expected: bool
) -> None:
    """Squares of 48 µm² over four frames are those of 1 µm along x and along y."""
    common = np.zeros(COMMON)
    common[JITTER : JITTER + 2] = squares, products
    tuning = TUNING._replace(displacement_floor=0.0)
    assert unwrap(surroundings.jitters)(least, tuning, common) == expected


def test_a_shake_is_forgotten_where_too_few_markers_are_left_to_show_it() -> None:
    common, contact = np.zeros(COMMON), np.ones((5, 5), bool)
    common[JITTER : JITTER + 2] = 48e-12, -30e-12
    frame = FrameArrays(0.0, np.zeros((5, 5, 3)), NO_FIELD, np.zeros(3), NO_FIELD, contact)
    room = np.empty((5, 5)), np.empty((3, 25))
    unwrap(surroundings.shift_of_surroundings)(frame, frame, (contact, contact), 0.0, room, TUNING, common)
    assert not unwrap(surroundings.jitters)(0.5e-12, TUNING, common)


def shifted(
    steps: list[tuple[float, float]],
    tuning: Tuning = TUNING,
    pose: np.ndarray = NO_POSE,
    width: int = 5,
    shaking: float = 0.0,
    noise: float = 0.0,
) -> np.ndarray:
    """Where the camera is said to be after steps of all markers but the middle one, which touches."""
    common, contact = np.zeros(COMMON), np.zeros((width, width), bool)
    common[SHAKING] = shaking
    contact[width // 2, width // 2] = True
    place, found = np.zeros((width, width, 3)), (0.0, 0.0)
    shift = unwrap(surroundings.shift_of_surroundings)
    for u, v in steps:
        moved = place.copy()
        moved[~contact] += [u, v, 0.0]
        last, frame = (FrameArrays(0.0, each, NO_FIELD, pose, NO_FIELD, contact) for each in (place, moved))
        room = np.empty((width, width)), np.empty((3, width**2))
        found = shift(last, frame, (contact, contact), noise**2, room, tuning, common)
        place = moved
    assert found == (common[SHIFT], common[SHIFT + 1])
    return np.array(found)


TO_AND_FRO = [(1e-5, -2e-5), (-1e-5, 2e-5)] * 6


def test_a_camera_is_where_markers_that_jitter_took_it() -> None:
    """The first step tells no jitter yet; all after it do."""
    np.testing.assert_allclose(shifted(TO_AND_FRO), [-1e-5, 2e-5], rtol=1e-9)
    np.testing.assert_allclose(shifted(TO_AND_FRO[:-1]), [0.0, 0.0], rtol=0.0, atol=1e-18)
    assert not shifted([(1e-5, 0.0)] * 8).any()


def test_what_markers_jitter_by_themselves_moves_no_camera() -> None:
    """Eight around one, so that a noise of σ gives their mean σ²/8, and twice that is needed."""
    near = TUNING._replace(surroundings_reach=1.0)
    alike = shifted(TO_AND_FRO, near, width=3)
    own = np.sqrt(8.0 / near.surroundings_noise * (1e-5**2 + 2e-5**2) / 3.0)  # steps to and fro: b = 2a, Σb² = 4·5a²
    np.testing.assert_array_equal(shifted(TO_AND_FRO, near, width=3, noise=0.5 * own), alike)
    assert not shifted(TO_AND_FRO, near, width=3, noise=2.0 * own).any()


def test_too_few_markers_say_nothing_nor_do_they_beside_a_given_pose_unless_the_camera_shakes() -> None:
    near = TUNING._replace(surroundings_reach=1.0)
    assert shifted(TO_AND_FRO, near, width=3).any()  # eight around one
    assert not shifted(TO_AND_FRO, near._replace(surroundings_least=9), width=3).any()
    assert not shifted(TO_AND_FRO, width=3).any()  # twice the radius of one element leaves four
    assert not shifted(TO_AND_FRO, pose=np.zeros(3)).any()
    assert shifted(TO_AND_FRO, pose=np.zeros(3), shaking=1.0).any()
    assert not shifted(TO_AND_FRO, tuning=TUNING._replace(surroundings_reach=9.0)).any()


def test_an_offset_is_pooled_by_weights_that_fall_with_what_it_is_off() -> None:
    """Beside 0.5, aslant 0.25; what is off by d with d² = s counts a quarter of that."""
    offsets = np.full((2, 3, 3), np.nan)
    offsets[:, 1, 1] = 0.0
    offsets[:, 0, 1] = [1.0, 0.0]
    offsets[:, 2, 2] = [0.0, 1.0]
    x, y, share = pooling.pooled_offset(offsets, 1, 1, 1.0, 0.5)
    total = 1.0 + 0.5 / 4.0 + 0.25 / 4.0
    assert (x, y) == pytest.approx((0.125 / total, 0.0625 / total), rel=1e-12)
    assert share == pytest.approx((1.0 + 0.125**2 + 0.0625**2) / total**2, rel=1e-12)


@pytest.mark.parametrize(
    ("place", "beside", "aslant"), [((0, 0), 2, 1), ((0, 1), 3, 2), ((1, 1), 4, 4), ((2, 2), 2, 1)]
)
def test_elements_at_the_edge_have_fewer_neighbours(place: tuple[int, int], beside: int, aslant: int) -> None:
    x, y, share = pooling.pooled_offset(np.ones((2, 3, 3)), *place, 1.0, 0.5)
    total = 1.0 + 0.5 * beside + 0.25 * aslant
    assert (x, y) == (1.0, 1.0)
    assert share == pytest.approx((1.0 + 0.25 * beside + 0.0625 * aslant) / total**2, rel=1e-12)


def test_offsets_are_of_markers_in_the_objects_frame_from_their_anchors() -> None:
    """An object turned by a quarter about (1, 2): what lies 1 m above it in y is 1 m along its x."""
    pose, one = Pose(1.0, 2.0, np.pi / 2, 1.0, 0.0, 1.0), np.ones(1)
    anchors = Anchors(np.array([0.75]), np.array([0.25]), one, np.array([1.0]), np.array([3.0]), one, one, one)
    offsets = np.zeros((2, 2, 2))
    pooling.find_offsets(anchors, pose, np.array([[1, 0]]), offsets)
    np.testing.assert_allclose(offsets[:, 1, 0], [0.25, -0.25], rtol=1e-12)
    assert np.isnan(np.delete(offsets.reshape(2, -1), 2, axis=1)).all()
