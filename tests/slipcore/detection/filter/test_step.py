"""Parts of the filter's step by hand, as plain Python."""

import math
from inspect import unwrap

import numpy as np
import pytest

from slipcore.defaults import FilterOptions
from slipcore.detection.filter.element import Measurements
from slipcore.detection.filter.pose import Anchors, pose_at
from slipcore.detection.filter.state import (
    COMMON,
    END,
    ONSET,
    PROBABILITY,
    ROWS,
    SLIP_VARIANCE,
    SLIP_X,
    SLIP_Y,
    STICK_VARIANCE,
    STICK_X,
    STICK_Y,
)
from slipcore.detection.filter.step import (
    decide,
    find_anchors,
    find_places,
    find_readiness,
    force_change,
    indentation_change,
    known_or,
    lasting_noise,
    look_at_markers,
    noise_of_frame,
    rooms_of,
    slip_of_neighbours,
    start_elements,
    touches_anew,
)
from slipcore.detection.filter.tuning import Tuning, settings_of
from slipcore.detection.shared.records import Decision, Memory, Surface

TUNING = Tuning(*settings_of(FilterOptions()))._replace(
    noise_margin=2.0, unknown_noise=5e-6, displacement_floor=0.0, force_noise_margin=3.0,
    lasting_ratio=2.0, lasting_least=3e-6, lasting_share=0.25,
)  # fmt: skip
FIELD = np.arange(18.0).reshape(2, 3, 3)
POSITION = 10.0 * FIELD


def surface(*noise: float) -> Surface:
    nothing = np.zeros((2, 3))
    return Surface(FIELD, nothing, nothing, np.ones((2, 3), bool), np.array(noise))


def test_noise_that_is_not_known_yet_is_what_the_options_say() -> None:
    assert unwrap(known_or)(3.0, 7.0) == 3.0
    assert unwrap(known_or)(math.nan, 7.0) == 7.0
    unknown = unwrap(noise_of_frame)(surface(math.nan, math.nan, math.nan, 0.0), TUNING)
    assert unknown == (pytest.approx((2.0 * 5e-6) ** 2), 0.0)
    known = unwrap(noise_of_frame)(surface(1e-6, 0.02, 0.0, 0.0), TUNING)
    assert known == (pytest.approx((2e-6) ** 2), pytest.approx(0.06))


def test_a_floor_and_noise_that_lasts_count_the_larger_of_both() -> None:
    """Noise between neighbours of 13 µm of which 5 µm pass: a quarter of 12² µm² lasts."""
    seen = surface(2e-6, 0.0, 13e-6, 0.0)
    lasts = TUNING._replace(lasting_least=3e-6)
    assert unwrap(lasting_noise)(2e-6, 13e-6, 0.0, lasts) == pytest.approx(6e-6)
    for floor, counts in ((1e-6, 6e-6), (8e-6, 8e-6)):
        variance, _ = unwrap(noise_of_frame)(seen, lasts._replace(displacement_floor=floor))
        assert variance == pytest.approx((4e-6) ** 2 + counts**2)


def test_rounding_lasts_as_far_as_passing_noise_does_not_show_it() -> None:
    """A step of √12 µm is an even error of 1 µm; its share of the variance is a quarter."""
    step = math.sqrt(12.0) * 1e-6
    assert unwrap(lasting_noise)(0.0, math.nan, step, TUNING) == pytest.approx(0.5e-6)
    assert unwrap(lasting_noise)(0.6e-6, math.nan, step, TUNING) == pytest.approx(0.5 * 0.8e-6)
    assert unwrap(lasting_noise)(1.1e-6, math.nan, step, TUNING) == 0.0


def test_an_element_touches_anew_where_contact_is_more_than_what_stays() -> None:
    contact = np.array([[True, False], [True, True]])
    assert not unwrap(touches_anew)(contact, contact.copy())
    assert unwrap(touches_anew)(contact, contact & [[True, True], [False, True]])


def test_places_are_those_that_stay_and_have_a_state_row_by_row() -> None:
    elements, places = np.zeros((ROWS, 2, 3)), np.full((6, 2), -1)
    elements[STICK_VARIANCE, 0, 1] = math.inf
    stays = np.array([[True, True, False], [True, False, True]])
    assert unwrap(find_places)(elements, stays, places) == 3
    assert places[:3].tolist() == [[0, 0], [1, 0], [1, 2]]


def test_rows_are_shared_out_to_as_many_anchors() -> None:
    rows = np.arange(18.0)[:, None] + 0.1 * np.arange(4)
    anchors, motion, deeper, change, evidence, seen, states = unwrap(rooms_of)(rows, 3)
    assert [each[1] for each in anchors] == pytest.approx([0.1, 1.1, 2.1, 3.1, 4.1, 5.1, 6.1, 7.1])
    assert [each[0] for each in motion] == [8.0, 9.0, 10.0]
    assert (deeper[2], len(deeper), change.shape, change[0, 0]) == (11.2, 3, (3, 4), 12.0)
    assert [each[0] for each in evidence] == [15.0, 16.0, 12.0, 13.0, 14.0]
    assert [each[0] for each in seen] == [5.0, 6.0, 7.0, 11.0, 15.0, 12.0, 13.0, 14.0]
    assert [each[0] for each in states] == [17.0, 0.0, 1.0, 2.0, 3.0, 4.0, 16.0]


def test_what_is_used_at_a_time_shares_no_rows() -> None:
    """The fit of the pose beside the change of force, the evidence of forces, and the states beside what is seen."""
    rows = np.arange(18.0)[:, None] + np.zeros(2)
    anchors, motion, deeper, change, evidence, seen, states = unwrap(rooms_of)(rows, 2)
    markers = anchors.x, anchors.y, anchors.marker_x, anchors.marker_y, seen.x, seen.y, seen.share
    for together in (
        (*anchors, *motion, deeper, *change),
        (*anchors[:5], *motion, *evidence),
        (*markers, *motion, seen.readiness, seen.by_force),
        (*seen, *states, *motion),
    ):
        assert len({float(row[0]) for row in together}) == len(together)


def test_an_anchor_is_where_an_element_would_be_if_it_stuck_and_where_its_marker_is() -> None:
    elements, places = np.zeros((ROWS, 2, 3)), np.array([[0, 1], [1, 2]])
    elements[STICK_X, 1, 2], elements[STICK_Y, 1, 2], elements[STICK_VARIANCE, 1, 2] = 4.0, 5.0, 6.0
    elements[PROBABILITY, 1, 2] = 0.3
    anchors = Anchors(*np.zeros((8, 2)))
    unwrap(find_anchors)(elements, places, POSITION, FIELD, (1.0, 2.0), anchors)
    assert (anchors.x[1], anchors.y[1], anchors.variance[1], anchors.stick[1]) == (4.0, 5.0, 6.0, 0.7)
    assert anchors.marker_x.tolist() == [33.0 - 1.0, 165.0 - 1.0]
    assert anchors.marker_y.tolist() == [44.0 - 2.0, 176.0 - 2.0]


def test_changes_are_deeper_inwards_and_of_force_forwards() -> None:
    places, deeper, change = np.array([[0, 1], [1, 2]]), np.zeros(2), np.zeros((3, 2))
    unwrap(indentation_change)(places, FIELD, 3.0 * FIELD, deeper)
    assert deeper.tolist() == [-10.0, -34.0]
    unwrap(force_change)(places, FIELD, 3.0 * FIELD, change)
    assert change.T.tolist() == [[6.0, 8.0, 10.0], [30.0, 32.0, 34.0]]
    unwrap(force_change)(places, FIELD, 3.0 * FIELD, change[:0])  # no forces: nothing to fill


def test_what_has_just_touched_sticks_where_it_is_and_of_what_does_not_nothing_is_known() -> None:
    """Of an object that is turned by 90° about (1, 1), with markers 0.5 to the right of where the camera sees them."""
    contact, stays = np.array([[True, True, False]] * 2), np.array([[True, False, False]] * 2)
    nothing = np.zeros((2, 3))
    after = Memory(contact, contact, nothing, np.zeros(1), np.full((ROWS, 2, 3), 0.7), np.zeros(COMMON))
    pose = pose_at(1.0, 1.0, math.pi / 2.0, 1.0)
    unwrap(start_elements)(POSITION, FIELD, (0.5, 0.0), stays, pose, 9.0, after)
    found = after.elements
    for x, y in ((STICK_X, STICK_Y), (SLIP_X, SLIP_Y)):
        assert (found[x, 0, 1], found[y, 0, 1]) == (pytest.approx(44.0 - 1.0), pytest.approx(-(33.0 - 0.5 - 1.0)))
        assert (found[x, 0, 2], found[y, 0, 2]) == (0.0, 0.0)
    for variance in (STICK_VARIANCE, SLIP_VARIANCE):
        assert found[variance, 0].tolist() == [0.7, 9.0, math.inf]
    assert found[END, 0].tolist() == [0.7, 1.0, 1.0]
    assert found[PROBABILITY, 0].tolist() == found[ONSET, 0].tolist() == [0.7, 0.0, 0.0]


@pytest.mark.parametrize(
    ("place", "mean"),
    [((1, 1), 0.25 * (0.1 + 0.7 + 0.3 + 0.8)), ((0, 0), 0.25 * (1.0 + 0.3 + 1.0 + 0.1)), ((2, 2), 0.25 * 3.5)],
)
def test_beyond_the_lattice_all_neighbours_slip(place: tuple[int, int], mean: float) -> None:
    slip = np.array([[0.5, 0.1, 0.9], [0.3, 0.6, 0.8], [0.2, 0.7, 0.4]])
    assert unwrap(slip_of_neighbours)(slip, *place) == pytest.approx(mean)


def test_slip_is_told_above_the_threshold_with_even_odds_there() -> None:
    decision = Decision(np.zeros((1, 4), bool), np.zeros((1, 4)))
    unwrap(decide)(np.array([[0.0, 0.2, 0.21, 1.0]]), np.zeros((1, 4)), 0.2, decision)
    assert decision.slip.tolist() == [[False, False, True, True]]
    odds = 0.21 / 0.79 * 4.0  # four times what they are
    np.testing.assert_allclose(decision.probability, [[0.0, 0.5, odds / (1.0 + odds), 1.0]])


def test_log_odds_that_are_expected_add_to_those_of_the_posterior() -> None:
    decision = Decision(np.zeros((1, 4), bool), np.zeros((1, 4)))
    unwrap(decide)(np.array([[0.0, 0.1, 0.3, 1.0]]), np.log([[3.0, 3.0, 0.5, 0.1]]), 0.2, decision)
    assert decision.slip.tolist() == [[False, True, False, True]]
    odds = np.array([[0.0, 4.0 * 3.0 / 9.0, 4.0 * 0.5 * 3.0 / 7.0]])
    np.testing.assert_allclose(decision.probability[:, :3], odds / (1.0 + odds))
    assert decision.probability[0, 3] == 1.0


def test_slip_begins_as_readily_as_neighbours_slip_or_not_at_all() -> None:
    elements, contact, found = np.zeros((ROWS, 3, 3)), np.ones((3, 3), bool), np.zeros(2)
    elements[PROBABILITY, 0, 1] = 0.8
    contact[2, 2] = False  # beyond the contact everything slips
    tuning, places = TUNING._replace(onset_inside=0.1, onset_at_front=2.0), np.array([[1, 1], [2, 1]])
    room = np.empty((3, 3))
    unwrap(find_readiness)(elements, contact, places, True, tuning, room, found)
    np.testing.assert_allclose(found, [0.1 + 2.0 * 0.2, 0.1 + 2.0 * 0.5], rtol=1e-15)
    unwrap(find_readiness)(elements, contact, places, False, tuning, room, found)
    assert not found.any()


def test_markers_are_where_they_are_or_drawn_to_their_neighbours() -> None:
    """Of an object that lies 3 to the right; a neighbour that weighs half as much lies 0.3 further."""
    anchors, places = Anchors(*np.zeros((8, 2))), np.array([[0, 0], [0, 1]])
    anchors.marker_x[:], pose = (3.0, 3.3), pose_at(3.0, 0.0, 0.0, 1.0)
    seen, offsets = Measurements(*np.full((8, 2), 9.0)), np.zeros((2, 1, 2))
    unwrap(look_at_markers)(anchors, pose, places, offsets, 1.0, 0.0, seen)
    np.testing.assert_allclose((seen.x, seen.y, seen.share), ([0.0, 0.3], [0.0, 0.0], [1.0, 1.0]), atol=1e-15)
    unwrap(look_at_markers)(anchors, pose, places, offsets, 1e9, 0.5, seen)
    np.testing.assert_allclose(seen.x, [0.1, 0.2], rtol=1e-8)  # 3 off by rounding, and weights of 1e-9 more
    np.testing.assert_allclose(seen.share, (1.0 + 0.25) / 1.5**2, rtol=1e-8)
