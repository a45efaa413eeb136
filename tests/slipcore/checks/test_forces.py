"""Forces against the markers and the gripper, on either side of each limit, and the numbers that are told."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from slipcore import GraspLog
from slipcore.checks import forces
from slipcore.defaults import CheckOptions
from slipcore.frames import unit
from tests.slipcore.checks.by_hand import log, over_time, subject, told

FRAMES = np.arange(40)
TOUCH, RELEASE = 8, 32
INSIDE = (FRAMES >= TOUCH) & (FRAMES < RELEASE)
GRID = (8, 8)
MIDDLE = np.s_[:, 3:5, 3:5]
CONTACT = np.zeros((40, *GRID), bool)
CONTACT[MIDDLE] = INSIDE[:, None, None]


def held(sideways: float = 0.0, **fields: object) -> GraspLog:
    """The middle four of 8 × 8 elements are pressed by 0.1 N each, unevenly, from frame 8 on and let go at 32."""
    displacement, force = np.zeros((40, *GRID, 3)), np.zeros((40, *GRID, 3))
    force[MIDDLE][INSIDE, ..., 2] = [[-0.09, -0.11], [-0.11, -0.09]]
    force[MIDDLE][INSIDE, ..., 0] = 0.1 * sideways
    displacement[MIDDLE][INSIDE] = [sideways * 1e-5, 0.0, -1e-4]
    return log(displacement, force, frames=40, grid=GRID, **fields)


def plus(recorded: GraspLog, more: object, **fields: object) -> GraspLog:
    """With more force on all elements."""
    assert recorded.force is not None
    force = np.broadcast_to(recorded.force + np.asarray(more), recorded.force.shape)
    return log(recorded.displacement, force, frames=40, grid=GRID, **fields)


@pytest.mark.parametrize(("offset", "said"), [(2.4e-3, ""), (2.6e-3, "elements read 2.6 mN in the mean")])
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_zero_is_off_above_a_fortieth_of_the_force_in_the_grasp(axis: int, offset: float, said: str) -> None:
    """Along z it is subtracted from what elements bear; all of them, so that it is like no contact's."""
    more = np.zeros(3)
    more[axis] = offset
    found = told(forces.zero_offset(subject(plus(held(), more), CONTACT)))
    if axis < 2:
        assert found.startswith(said)
        assert bool(found) == bool(said)
    if said:
        assert f"{offset / (0.1 - more[2]):.0%} of their force in the grasp" in found


def test_a_zero_like_the_contact_is_one_of_the_markers() -> None:
    """The same readings at rest as in the grasp, by a tenth: they were zeroed while something touched."""
    recorded = held()
    like = np.where(INSIDE[:, None, None, None], 0.0, 0.1 * np.asarray(recorded.force)[20])
    assert not any(forces.zero_offset(subject(plus(recorded, like), CONTACT)))
    unlike = np.where(
        INSIDE[:, None, None, None], 0.0, 0.1 * np.roll(np.asarray(recorded.force)[20], 3, 0) + [0, 0, 0.02]
    )
    assert any(forces.zero_offset(subject(plus(recorded, unlike), CONTACT)))


def test_forces_that_follow_from_the_markers_contradict_them_in_nothing() -> None:
    recorded = plus(held(), [0.05, 0.0, 0.0], metadata={"force": "reconstructed"}, gripper_force=np.full(40, 9.0))
    for check in (forces.zero_offset, forces.zero_drift, forces.gripper_force, forces.force_frame):
        assert not any(check(subject(recorded, CONTACT)))


@pytest.mark.parametrize(("drift", "is_found"), [(2.4e-3, False), (2.8e-3, True)])
def test_a_zero_drifts_by_elements_beside_the_contact_from_its_first_to_its_last_fifth(
    drift: float, is_found: bool
) -> None:
    """It jumps in the middle of the grasp."""
    jump = over_time(np.where(FRAMES < 20, 0.0, drift), 0)
    found = told(forces.zero_drift(subject(plus(held(), jump), CONTACT)))
    said = f"elements beside the contact read {1e3 * drift:.2g} mN more at its end than at its begin, 3% of the force"
    assert found.startswith(said if is_found else "")
    assert bool(found) == is_found


def test_scatter_along_one_axis_hides_no_drift_along_another() -> None:
    scatter = 0.05 * np.random.default_rng(3).standard_normal(GRID)
    more = over_time(np.where(FRAMES < 20, 0.0, 5e-3), 0) + np.zeros((40, *GRID, 3))
    more[20:, ..., 1] += scatter
    found = told(forces.zero_drift(subject(plus(held(), more), CONTACT)))
    assert found.startswith("elements beside the contact read 5 mN more")


@pytest.mark.parametrize("seed", range(20))
def test_scatter_between_elements_is_no_drift(seed: int) -> None:
    more = np.where(FRAMES < 20, 0.0, 1.0)[:, None, None, None] * np.random.default_rng(seed).normal(
        0.0, 0.01, (*GRID, 3)
    )
    assert not any(forces.zero_drift(subject(plus(held(), more), CONTACT)))


@pytest.mark.parametrize(("distance", "free"), [(0, 60), (1, 48), (2, 28), (3, 0)])
def test_elements_beside_the_contact_are_some_away_from_all_that_touch(distance: int, free: int) -> None:
    """Of 64 elements four touch, 16 are within one of them, 36 within two and all within three."""
    seen = subject(held(), CONTACT, free_distance=distance)
    elements, early, late, _ = forces._beside_the_contact(seen)
    assert np.count_nonzero(elements) == free
    np.testing.assert_array_equal(np.flatnonzero(early), TOUCH + np.arange(4))  # a fifth of 24
    np.testing.assert_array_equal(np.flatnonzero(late), RELEASE - 4 + np.arange(4))


def test_elements_that_touch_for_a_twentieth_of_the_frames_do_so_passingly() -> None:
    for frames, free in ((2, 28), (3, 3)):  # of 40
        contact = CONTACT.copy()
        contact[:frames] = True
        contact[:frames, 0, :3] = False
        elements, *_ = forces._beside_the_contact(subject(held(), contact, free_distance=0 if frames > 2 else 2))
        assert np.count_nonzero(elements) == (free if free >= 4 else 0)  # and fewer than four tell nothing


def test_a_zero_drifts_by_the_rest_after_the_grasp() -> None:
    """Of a lattice that all touches, of which no element is beside the contact."""
    depth = over_time(np.where(INSIDE, -1e-4, 0.0), 2)
    press = over_time(np.where(INSIDE, -0.1, 0.0), 2)
    after = over_time(np.where(FRAMES < RELEASE, 0.0, 5e-3), 1)
    recorded = log(depth, press + after, frames=40, grid=GRID)
    seen = subject(recorded, contact=INSIDE[:, None, None])
    found = told(forces.zero_drift(seen))
    assert found.startswith("elements that it touches read 5 mN more at its end than at its begin, 5% of the force")
    assert not any(forces.zero_drift(subject(log(depth, press, frames=40, grid=GRID), contact=INSIDE[:, None, None])))
    assert not any(forces.zero_drift(subject(recorded, INSIDE[:, None, None], least_rest=9)))  # eight on either side


def gripped(reported: object, deviation: float | None = None) -> GraspLog:
    """The four elements bear 0.4 N, and the gripper reports this."""
    force = np.broadcast_to(np.asarray(reported, float), 40)
    return held(gripper_force=force, gripper_force_deviation=deviation)


@pytest.mark.parametrize(
    ("reported", "said"), [(0.4 / 1.14, ""), (0.4 / 1.17, "1.2"), (0.4 * 1.14, ""), (0.4 * 1.17, "0.85")]
)
def test_the_gripper_contradicts_forces_by_15_per_cent_either_way(reported: float, said: str) -> None:
    found = told(forces.gripper_force(subject(gripped(reported), CONTACT)))
    assert found == (f"the normal forces of all elements add up to {said} of what the gripper reports" if said else "")


def test_a_gripper_that_is_unsure_contradicts_by_three_deviations_at_least() -> None:
    for deviation, is_found in ((0.03, True), (0.07, False)):  # three are 0.18 and 0.42 of 0.5 N; differ by 0.25
        assert any(forces.gripper_force(subject(gripped(0.5, deviation), CONTACT))) == is_found


def test_forces_that_part_from_the_gripper_during_the_grasp_are_told_as_it_begins_and_ends() -> None:
    """It grips harder step by step, by less than a twentieth within a tenth of a second."""
    for most, is_found in ((1.06, False), (1.12, True)):
        reported = np.ones(40)
        reported[TOUCH:RELEASE] = np.linspace(1.0, most, 24)
        reported[RELEASE:] = most
        found = told(forces.gripper_force(subject(gripped(0.4 * reported), CONTACT)))
        assert bool(found) == is_found
    assert "add up to 0.99 of what the gripper reports as the grasp begins, and to 0.9 as it ends" in found


def test_what_the_gripper_reports_while_it_closes_is_not_compared() -> None:
    """Less than four fifths of its largest, or changing by a twentieth of it within a tenth of a second."""
    closing = np.full(40, 0.4)
    closing[TOUCH : TOUCH + 10] = 0.25
    assert not any(forces.gripper_force(subject(gripped(closing), CONTACT)))
    shaking = 0.4 * (1.0 + 0.1 * np.where(FRAMES // 2 % 2, 1.0, -1.0) * (FRAMES < 30))
    steady = subject(gripped(shaking), CONTACT)
    assert not any(forces.gripper_force(steady))  # fewer than eight frames are steady


def test_a_contact_that_leaves_the_lattice_may_bear_from_a_quarter_of_the_grippers_force_on() -> None:
    contact = CONTACT.copy()
    contact[TOUCH:RELEASE, 0, :5] = True  # five at the edge, and four inside
    for reported, is_found in ((0.4 / 0.26, False), (0.4 / 0.24, True), (0.4 / 1.2, True)):
        assert any(forces.gripper_force(subject(gripped(reported), contact))) == is_found
    contact[:, 0, 0] = False
    contact[TOUCH:RELEASE, 2, 3] = True
    assert forces._leaves_the_lattice(subject(held(), contact), FRAMES[INSIDE])
    assert not forces._leaves_the_lattice(subject(held(), CONTACT), FRAMES[INSIDE])


@pytest.mark.parametrize(("degrees", "said"), [(1.6, ""), (2.0, "normals lean by 2.0°")])
@pytest.mark.parametrize("axis", [0, 1])
def test_normals_lean_by_more_than_a_thirtieth(axis: int, degrees: float, said: str) -> None:
    normal = np.zeros((40, *GRID, 3))
    normal[..., axis], normal[..., 2] = np.sin(np.radians(degrees)), np.cos(np.radians(degrees))
    found = told(forces.leaning_normals(subject(held(normal=normal), CONTACT)))
    assert found.startswith(said)
    assert bool(found) == bool(said)


@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize("degrees", [30.0, 60.0, 90.0])
def test_a_large_lean_is_told_as_an_angle(axis: int, degrees: float) -> None:
    """By 90° axes are exchanged: lines along the lean are square to no normal then."""
    normal = np.zeros((40, *GRID, 3))
    normal[..., axis], normal[..., 2] = np.sin(np.radians(degrees)), np.cos(np.radians(degrees))
    found = told(forces.leaning_normals(subject(held(normal=normal), CONTACT)))
    assert found.startswith(f"normals lean by {degrees:.1f}°")


def lean(normal: np.ndarray, place: np.ndarray) -> tuple[float, float] | None:
    """Of one frame."""
    return forces._lean(normal, place, CheckOptions())


def dome(elements: int, pitch: float, aside: float, radius: float = 15e-3) -> tuple[np.ndarray, np.ndarray]:
    """Places and normals of a piece of a sphere."""
    line = (np.arange(elements) - (elements - 1) / 2) * pitch
    x, y = np.meshgrid(line + aside, line)
    place = np.stack([x, y, np.sqrt(radius**2 - x**2 - y**2)], axis=-1)
    return place, place / radius


@pytest.mark.parametrize("aside", [0.0, 2e-3, 4e-3])
def test_flat_places_under_the_normals_of_a_dome_show_no_surface(aside: float) -> None:
    place, normal = dome(5, 1e-3, aside)
    assert lean(normal, place * np.array([1.0, 1.0, 0.0])) is None
    found = lean(normal, place)
    assert found is not None
    assert found[0] < 1e-6


def test_a_rim_between_few_elements_is_no_lean() -> None:
    """Normals turn faster on its far side than on its near one: 2.0° on these nine."""
    x, y = np.meshgrid(np.array([0.0, 3e-3, 6e-3]), np.array([0.0, 3e-3, 6e-3]))
    place = np.stack([x, y, -(x**4 + y**4) * 1.25e6], axis=-1)
    angle, error = lean(unit(np.stack([5e6 * x**3, 5e6 * y**3, np.ones_like(x)], axis=-1)), place) or (0.0, 0.0)
    assert np.degrees(angle) == pytest.approx(2.0, abs=0.1)
    assert 3.0 * error > angle


def test_a_lean_of_noisy_normals_is_told_with_its_error() -> None:
    rng = np.random.default_rng(0)
    place = dome(8, 1e-3, 0.0)[0] * np.array([1.0, 1.0, 0.0])
    noisy = unit(np.array([np.sin(0.15), 0.0, np.cos(0.15)]) + 0.2 * rng.standard_normal(place.shape))
    found = lean(noisy, place)
    assert found is not None
    assert found[0] == pytest.approx(0.15, abs=0.06)
    assert 3.0 * found[1] < found[0]  # though one line's normals scatter by as much


def test_of_fewer_than_three_rows_no_lean_is_told() -> None:
    normal = np.zeros((40, 2, 8, 3))
    normal[..., 0], normal[..., 2] = np.sin(0.1), np.cos(0.1)
    still = np.zeros((40, 2, 8, 3))
    few = subject(log(still, still, frames=40, grid=(2, 8), normal=normal), np.zeros((40, 2, 8), bool))
    assert not any(forces.leaning_normals(few))


def test_normals_that_lean_in_some_frames_only_are_left_alone() -> None:
    normal = np.zeros((40, *GRID, 3))
    normal[..., 2] = 1.0
    normal[:6, ..., 0], normal[:6, ..., 2] = np.sin(0.1), np.cos(0.1)
    assert not any(forces.leaning_normals(subject(held(normal=normal), CONTACT)))


def pulled(force: np.ndarray, path: np.ndarray) -> GraspLog:
    """While they are pressed the four elements move along a path [t, 2], and feel a share [t, 2] of their force."""
    displacement, forces_ = np.zeros((40, *GRID, 3)), np.zeros((40, *GRID, 3))
    displacement[MIDDLE][..., :2] = path[:, None, None]
    forces_[MIDDLE][INSIDE, ..., 2] = -0.1
    forces_[MIDDLE][..., :2] += 0.1 * force[:, None, None] * INSIDE[:, None, None, None]
    return log(displacement, forces_, frames=40, grid=GRID)


SHARE = np.clip((FRAMES - TOUCH) / (RELEASE - TOUCH - 1.0), 0.0, 1.0)
ALONG = SHARE[:, None] * [1.0, 0.0]
BOTH = np.stack([np.sin(3.0 * SHARE), 1.0 - np.cos(3.0 * SHARE)], axis=-1)
"""From 0 on along a bow, so that a mirror is no turn."""


@pytest.mark.parametrize(("lean", "said"), [(0.07, ""), (0.1, "0.10 of the normal force points sideways")])
def test_forces_lean_that_point_sideways_where_no_marker_moves_so(lean: float, said: str) -> None:
    found = told(forces.force_frame(subject(pulled(0.4 * ALONG + [0.0, lean], 1e-4 * ALONG), CONTACT)))
    assert found.startswith(said)
    assert bool(found) == bool(said)
    assert "forces lean by 6° against the markers" in found or not said


@pytest.mark.parametrize(("degrees", "said"), [(40.0, ""), (-50.0, "50°"), (90.0, "90°"), (180.0, "180°")])
def test_forces_point_elsewhere_from_45_degrees_on(degrees: float, said: str) -> None:
    sine, cosine = np.sin(np.radians(degrees)), np.cos(np.radians(degrees))
    turned = 0.4 * BOTH @ np.array([[cosine, sine], [-sine, cosine]])
    found = told(forces.force_frame(subject(pulled(turned, 1e-4 * BOTH), CONTACT)))
    assert found == (f"forces point {said} away from where the markers go" if said else "")


def test_exchanged_axes_go_with_the_markers_as_in_a_mirror() -> None:
    found = told(forces.force_frame(subject(pulled(0.4 * BOTH[:, ::-1], 1e-4 * BOTH), CONTACT)))
    assert found == "forces go with the markers as in a mirror: two axes are exchanged, or one is reversed"


def test_a_direction_is_a_vector_over_its_length_and_nothing_stays_nothing() -> None:
    found = unit(np.array([[0.3, 0.0, 0.4], [0.0, 0.0, 0.0]]))
    np.testing.assert_allclose(found, [[0.6, 0.0, 0.8], [0.0, 0.0, 0.0]], rtol=1e-15)


def test_what_elements_read_alike_is_freed_of_what_they_differ_by_and_of_noise() -> None:
    """A mean of 3 along x and 4 along y, whose elements differ by 0.1 along x: of four, 1/4 of that is taken off."""
    limits, read = CheckOptions(), np.array([[2.9, 4.0, 0.0], [3.1, 4.0, 0.0], [2.9, 4.0, 0.0], [3.1, 4.0, 0.0]])
    still = np.repeat(read[None], 5, axis=0)
    assert forces._alike(read, [forces._of_medians(still)], limits) == pytest.approx(
        np.sqrt(25.0 - (0.04 / 3.0) / 4.0), rel=1e-12
    )
    noisy = still + 2.0 * np.array([1.0, -1.0, 1.0, -1.0, 0.0])[:, None, None] * [0.0, 1.0, 0.0]  # variance 4
    passing = 0.5 * np.pi * 4.0 / 5.0 / 4.0  # of medians of five frames, in the mean of four elements
    assert forces._alike(read, [forces._of_medians(noisy)], limits) == pytest.approx(
        np.sqrt(25.0 - 0.01 / 3.0 - passing), rel=1e-12
    )


@pytest.mark.parametrize(("spread", "found"), [(0.64, 1.0), (0.66, 0.0)])
def test_a_mean_counts_from_as_many_errors_as_chance_hardly_makes_of_few_elements(spread: float, found: float) -> None:
    """By Student's distribution three standard deviations are 9.2 standard errors of four elements."""
    read = 3.0 + np.array([-spread, spread, -spread, spread])[:, None] * np.sqrt(0.75) * np.ones(3)
    still = forces._of_medians(np.repeat(read[None], 5, axis=0))
    assert (forces._alike(read, [still], CheckOptions()) > 0.0) == found


@pytest.mark.parametrize("frames", [(5, 5), (5, 60), (60, 5), (60, 60)])
def test_noise_of_one_element_is_no_drift_however_few_frames_begin_or_end_a_grasp(frames: tuple[int, int]) -> None:
    """By chance of one in 370 for each of three components, and somewhat more as noise of medians is a little wider."""
    rng, found = np.random.default_rng(0), 0
    for _ in range(500):
        early, late = (rng.standard_normal((count, 1, 3)) for count in frames)
        moved = np.median(late, axis=0) - np.median(early, axis=0)
        found += forces._alike(moved, [forces._of_medians(early), forces._of_medians(late)], CheckOptions()) > 0.0
    assert found < 12


def test_rest_before_and_after_a_grasp_lies_outside_of_all_frames_held(monkeypatch: pytest.MonkeyPatch) -> None:
    """Even if markers are back where they were in the first and last of these."""
    held, touched = np.array([False, False, True, False, True, True, False]), np.ones((1, 1), bool)
    monkeypatch.setattr(forces, "frames_at_rest", lambda _: np.array([False, True, True, True, True, True, True]))
    seen: Any = SimpleNamespace(held=held)
    elements, early, late, where = forces._before_and_after(seen, touched)
    assert elements is touched
    assert np.flatnonzero(early).tolist() == [1]
    assert np.flatnonzero(late).tolist() == [6]
    assert where == "that it touches"
