"""How long nothing has happened, and whether a load that grows sticks all again, step by step as plain Python."""

import math
from inspect import unwrap

import numpy as np
import pytest

from slipcore.defaults import FilterOptions
from slipcore.detection.filter import hold, loading, pose
from slipcore.detection.filter.pose import AnchorMotion, Anchors, PoseVariance, pose_at
from slipcore.detection.filter.state import (
    COMMON,
    FRICTION,
    HELD_FRAMES,
    HELD_LOAD,
    HELD_POSE,
    HELD_PRESSING,
    LOADING,
    ROWS,
    STILL,
)
from slipcore.detection.filter.tuning import Tuning, settings_of
from slipcore.detection.shared.records import NO_MASK, NO_POSE, FrameArrays, Surface
from tests.slipcore.plain_kernels import as_plain_python

TUNING = Tuning(*settings_of(FilterOptions()))._replace(
    hold_time=0.25, hold_deviations=4.0, ratio_least_force=0.0, displacement_floor=0.0, loading_smoothing=0.0,
    pressing_force_floor=0.1, pressing_force_deviations=2.0, pressing_slope=0.4, pressing_share=0.5,
    pressing_floor=1e-6, pressing_deviations=2.0, stiffness_ratio=0.5,
)  # fmt: skip
INTERVAL = 0.1
PLACES = np.array([1e-3, -1e-3])


@pytest.fixture(autouse=True)
def plain(monkeypatch: pytest.MonkeyPatch) -> None:
    as_plain_python(monkeypatch, pose, hold, loading)
    monkeypatch.setattr(loading, "unpack", lambda array, size: tuple(array[:size]))


def anchors(count: int = 2) -> Anchors:
    room = np.zeros(count)
    return Anchors(PLACES[:count], 0.0 * room, room, PLACES[:count], 0.0 * room, room, room, room)


def still(
    ways: list[float], forces: list[float], common: np.ndarray, count: int = 2, has_force: bool = True
) -> list[bool]:
    """Whether it is held in each frame, of which the object has gone so far and bears so much; noise of 1 µm and 1 mN
    in all.
    """
    found = []
    for way, force in zip(ways, forces, strict=True):
        field = np.zeros((1, 1, 3))
        field[0, 0, 2] = force
        frame = FrameArrays(0.0, field, field, NO_POSE, field, NO_MASK)
        where = pose_at(way, 0.0, 0.0, 1.0)
        spread, noise = PoseVariance(1e-12, 0.0, way, 0.0), (INTERVAL, 1e-12, 1e-3)
        found.append(unwrap(hold.step_hold)(anchors(count), where, spread, frame, noise, has_force, TUNING, common))
    return found


def test_what_is_still_for_longer_than_the_hold_time_is_held() -> None:
    common = np.zeros(COMMON)
    assert still([0.0] * 5, [1.0] * 5, common) == [False, False, False, True, True]
    assert common[STILL] == pytest.approx(0.4)
    assert common[HELD_FRAMES] == 5.0


@pytest.mark.parametrize(("way", "force"), [(1e-5, 1.0), (0.0, 1.02)])
def test_a_motion_or_a_change_of_load_begins_anew(way: float, force: float) -> None:
    common = np.zeros(COMMON)
    assert still([0.0] * 4 + [way] * 4, [1.0] * 4 + [force] * 4, common)[3:] == [True, False, False, False, True]
    assert common[HELD_FRAMES] == 4.0
    assert common[HELD_POSE] == pytest.approx(way)
    assert common[HELD_LOAD + 2] == pytest.approx(force)


def test_means_are_of_all_frames_since_something_happened() -> None:
    common = np.zeros(COMMON)
    still([0.0, 1e-6, 2e-6], [1.0, 1.001, 1.002], common)
    assert common[HELD_POSE] == pytest.approx(1e-6)
    assert common[HELD_POSE + 3] == pytest.approx(1.0)
    assert common[HELD_LOAD + 2] == pytest.approx(1.001)
    assert common[HELD_FRAMES] == 3.0


def test_without_anchors_nothing_is_remembered_and_without_forces_depth_counts() -> None:
    common = np.zeros(COMMON)
    assert still([0.0] * 5, [1.0] * 5, common, count=0) == [False] * 5
    assert (common[HELD_FRAMES], common[STILL]) == (0.0, 0.0)
    assert not still([0.0] * 5, [0.0, 0.0, 0.0, 0.0, 1e-5], np.zeros(COMMON), has_force=False)[-1]
    assert still([0.0] * 5, [0.0, 0.0, 0.0, 0.0, 1e-6], np.zeros(COMMON), has_force=False)[-1]


@pytest.mark.parametrize(
    ("still", "load", "has_force", "given", "keeps"),
    [
        (0.3, 1.0, False, False, True),
        (0.25, 1.0, False, False, False),
        (0.3, 1.00002, False, False, False),
        (0.3, 1.0, True, False, True),
        (0.25, 1.0, True, False, False),
        (0.3, 2.0, True, False, False),
        (0.3, 1.0, False, True, False),
        (0.3, 1.0, True, True, False),
    ],
)
def test_elements_touch_as_they_did_while_all_is_held(
    still: float, load: float, has_force: bool, given: bool, keeps: bool
) -> None:
    """Of 1 m of depth with a noise of 1 µm, or 1 N with 1 mN, in the mean of four frames."""
    common, field = np.zeros(COMMON), np.zeros((1, 1, 3))
    common[STILL], common[HELD_FRAMES], common[HELD_LOAD + 2], field[0, 0, 2] = still, 4.0, 1.0, load
    contact = np.ones((1, 1), bool) if given else NO_MASK
    frame = FrameArrays(0.0, field, field, NO_POSE, field, contact)
    assert unwrap(hold.keeps_contact)(frame, (1e-12, 1e-3), has_force, TUNING, common) == keeps


def test_of_a_held_contact_only_elements_whose_force_has_changed_beyond_noise_come_or_go() -> None:
    """Of each pair one has, by 3 mN where 2 are noise."""
    elements, before = np.zeros((ROWS, 1, 6)), np.array([[True, True, False, False, True, False]])
    elements[HELD_PRESSING] = 0.05
    found = np.array([[False, False, True, True, True, False]])
    stays = found & before
    pressing = 0.05 + np.array([[-0.001, -0.003, 0.001, 0.003, 0.1, -0.1]])
    surface = Surface(np.zeros((1, 6, 3)), pressing, 0.0 * pressing, stays, np.zeros(4))
    unwrap(hold.hold_contact)(elements, before, surface, 0.002, found)
    assert found.tolist() == [[True, False, False, True, True, False]]
    assert stays.tolist() == [[True, False, False, False, True, False]]


def test_the_held_force_is_the_mean_of_all_frames_since_something_happened() -> None:
    elements, seen = np.full((ROWS, 1, 1), 9.0), [1.0, 2.0, 6.0]
    for frames, force in enumerate(seen, start=1):
        unwrap(hold.follow_held_pressing)(elements, np.array([[force]]), float(frames), elements)
    assert elements[HELD_PRESSING, 0, 0] == pytest.approx(3.0)
    unwrap(hold.follow_held_pressing)(elements, np.array([[5.0]]), 0.0, elements)  # nothing is held
    assert elements[HELD_PRESSING, 0, 0] == pytest.approx(5.0)


def resticks(
    change: tuple[float, float, float], friction: tuple[float, float] = (0.0, 0.0), noise: float = 1e-3
) -> tuple[bool, np.ndarray]:
    """By a change of the force on two elements, N in all, x, y and inwards."""
    before, after = np.zeros(COMMON), np.zeros(COMMON)
    before[FRICTION : FRICTION + 2] = friction
    force = np.repeat(np.array([change[0], change[1], -change[2]])[:, None] / 2.0, 2, axis=1)
    nothing = np.zeros(2)
    motion = AnchorMotion(nothing, nothing, nothing)
    step = unwrap(loading.restick_under_load)
    found = step(before, after, anchors(), motion, nothing, force, (INTERVAL, 1e-12, noise), TUNING)
    return found, after[LOADING : LOADING + 6]


@pytest.mark.parametrize(
    ("friction", "slope"), [((0.0, 0.0), 0.4), ((1.2, 2.0), 0.3), ((0.5, 0.0), 0.4), ((0.0, 3.0), 0.4)]
)
def test_all_sticks_while_sideways_grows_by_less_than_half_of_friction_or_the_usual_slope(
    friction: tuple[float, float], slope: float
) -> None:
    """Friction is its weighted sum over its weight; a force of 1 N more within 0.1 s is 10 N/s."""
    for share, expected in ((0.99, True), (1.01, False)):
        found, rates = resticks((share * slope, 0.0, 1.0), friction)
        assert found == expected
        np.testing.assert_allclose(rates, [0.0, 0.0, 10.0, 10.0 * share * slope, 0.0, 0.0], rtol=1e-9, atol=1e-12)


def test_a_growth_within_noise_sticks_nothing() -> None:
    """Of the sum of two elements the change has 2 · 0.01 N of noise, in 0.1 s; twice that and a floor of 0.1 N/s."""
    least = 2.0 * (math.sqrt(2.0 * 2.0) * 0.01 / 0.1 + 0.1) * 0.1
    assert not resticks((0.0, 0.0, 0.99 * least), noise=0.01)[0]
    assert resticks((0.0, 0.0, 1.01 * least), noise=0.01)[0]
    assert not resticks((0.0, 0.0, -1.0))[0]


@pytest.mark.parametrize(("deeper", "way", "sticks"), [(2e-6, 0.0, True), (2e-6, 1.5e-6, True), (2e-6, 1.7e-6, False)])
def test_without_forces_all_sticks_by_depth_that_grows_faster_than_the_object_moves(
    deeper: float, way: float, sticks: bool
) -> None:
    """Half of the motion against 0.4 of the depth."""
    after, places = np.zeros(COMMON), np.full(2, 1.0)
    motion = AnchorMotion(way * places, 0.0 * places, places)
    step, noise = unwrap(loading.restick_under_load), (INTERVAL, 1e-16, 1e-3)
    found = step(np.zeros(COMMON), after, anchors(), motion, deeper * places, np.zeros((3, 0)), noise, TUNING)
    assert found == sticks
    np.testing.assert_allclose(after[LOADING : LOADING + 2], [deeper / INTERVAL, way / INTERVAL], rtol=1e-9)


def test_nothing_sticks_again_where_nothing_touches() -> None:
    before = np.full(COMMON, 5.0)
    after, none = np.zeros(COMMON), np.zeros(0)
    step, noise = unwrap(loading.restick_under_load), (INTERVAL, 1e-12, 1e-3)
    nothing = AnchorMotion(none, none, none)
    assert not step(before, after, anchors(0), nothing, none, np.zeros((3, 0)), noise, TUNING)
    assert not after[LOADING : LOADING + 6].any()
