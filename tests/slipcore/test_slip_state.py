import numpy as np
import pytest

from slipcore.slip_state import SlipHistory, SlipState, _of_neighbours, element_states, observed_over_time, slip_events


def field(*frames: list[int]) -> np.ndarray:
    """[t, 2, 3] bool from one row-major list of elements a frame."""
    states = np.zeros((len(frames), 6), bool)
    for state, elements in zip(states, frames, strict=True):
        state[elements] = True
    return states.reshape(-1, 2, 3)


TIME = np.array([0.5, 0.7, 1.0, 2.0])


def test_events_are_the_changes_of_state_at_the_frame_that_shows_them() -> None:
    contact = field([0], [0, 4, 5], [0, 4, 5], [0, 5])
    slip = field([], [0], [0, 5], [5])
    events = slip_events(TIME, contact, slip)
    assert (list(events.touch.element), list(events.touch.time)) == ([4, 5], [0.7, 0.7])
    assert (list(events.onset.element), list(events.onset.time)) == ([0, 5], [0.7, 1.0])
    assert (list(events.end.element), list(events.end.time)) == ([0], [2.0])
    assert (list(events.release.element), list(events.release.time)) == ([4], [2.0])
    assert events.onset.element.dtype == np.int64


def test_a_release_while_slipping_is_no_end_of_slip() -> None:
    events = slip_events(TIME[:2], field([3], []), field([3], []))
    assert len(events.end) == 0
    assert list(events.release.element) == [3]


def test_the_first_frame_changes_nothing() -> None:
    events = slip_events(TIME[:1], field([1]), field([1]))
    assert not any(len(kind) for kind in (events.onset, events.end, events.touch, events.release))


def test_nothing_is_told_of_an_element_that_was_not_observed_in_both_frames() -> None:
    contact, slip = field([0, 1], [0], [0, 1], [0, 1]), field([0], [0], [0, 1], [0])
    observed = field(*[list(range(6))] * 4)
    observed[1, 0, 1] = False
    events = slip_events(TIME, contact, slip, observed)
    assert not any(len(kind) for kind in (events.touch, events.release, events.onset))
    assert (list(events.end.element), list(events.end.time)) == ([1], [2.0])
    assert [len(kind) for kind in (slip_events(TIME, contact, slip).touch, slip_events(TIME, contact, slip).onset)] == [
        1,
        1,
    ]


def test_a_masked_answer_counts_what_was_observed_only() -> None:
    contact, slip = field([0, 1, 2])[0], field([0])[0]
    whole = SlipState(0.1, contact, slip, 0.9 * slip, 2 / 3, np.zeros((2, 3, 2)), macro_slip=False)
    observed, throughout = field([0, 2, 3])[0], field([0, 3])[0]
    seen = whole.masked(observed, throughout)
    np.testing.assert_array_equal(seen.contact, field([0, 2])[0])
    assert seen.stick_ratio == 0.5
    np.testing.assert_array_equal(np.isfinite(seen.velocity[..., 0]), throughout)
    assert whole.masked(field([0])[0], throughout).macro_slip
    nothing = whole.masked(field([])[0], throughout)
    assert np.isnan(nothing.stick_ratio)
    assert not nothing.macro_slip


def test_what_was_observed_is_none_where_all_was() -> None:
    contact = field([0])[0]
    whole = SlipState(0.1, contact, contact, 1.0 * contact, 0.0, np.zeros((2, 3, 2)), macro_slip=True)
    assert observed_over_time([whole, whole]) is None
    observed = observed_over_time([whole, whole.masked(contact, contact)])
    assert observed is not None
    np.testing.assert_array_equal(observed, np.stack([np.ones_like(contact), contact]))


def test_an_elements_state_counts_from_no_contact_over_stick_to_slip() -> None:
    contact, slip = np.array([False, True, True, False]), np.array([False, False, True, True])
    assert element_states(contact, slip).tolist() == [0, 1, 2, 0]


def test_neighbours_across_a_corner_count_half() -> None:
    ones = np.ones((1, 3, 3))
    assert _of_neighbours(ones)[0].tolist() == [[2.5, 4.0, 2.5], [4.0, 6.0, 4.0], [2.5, 4.0, 2.5]]
    corner = np.zeros((1, 3, 3))
    corner[0, 0, 0] = 2.0
    assert _of_neighbours(corner)[0].tolist() == [[0.0, 2.0, 0.0], [2.0, 1.0, 0.0], [0.0, 0.0, 0.0]]


def history(contact: np.ndarray, slip: np.ndarray, observed: np.ndarray | None = None) -> SlipHistory:
    probability = np.where(slip, 0.8, 0.1)
    events = slip_events(TIME[: len(contact)], contact, slip)
    return SlipHistory(
        TIME[: len(contact)],
        contact,
        slip,
        probability,
        np.zeros(len(contact)),
        np.zeros((*contact.shape, 2)),
        np.ones(len(contact), bool),
        events,
        1e-6,
        "filter",
        observed=observed,
    )


def test_an_element_that_was_not_observed_is_as_most_of_its_neighbours() -> None:
    """The middle of the upper row: of 1 + 1 + 1 beside and 2 halves across the corners 2.5 touch, and slip by 0.8."""
    contact, slip = field([0, 2, 3]), field([0, 2, 3])
    observed = ~field([1])
    filled = history(contact, slip, observed).filled()
    assert filled.contact[0, 0, 1]
    assert filled.slip[0, 0, 1]
    assert filled.probability[0, 0, 1] == pytest.approx(0.8)
    assert filled.stick_ratio.tolist() == [0.0]
    assert filled.macro_slip.tolist() == [True]
    few = history(field([0, 3]), field([0]), observed).filled()  # 1.5 of 4
    assert not few.contact[0, 0, 1]
    assert few.stick_ratio.tolist() == [0.5]
    assert few.macro_slip.tolist() == [False]
    assert np.isnan(history(field([]), field([]), observed).filled().stick_ratio[0])


def test_of_which_half_slips_an_element_sticks() -> None:
    filled = history(field([0, 2, 3, 5]), field([0]), ~field([1])).filled()
    assert filled.contact[0, 0, 1]
    assert filled.probability[0, 0, 1] == pytest.approx((0.8 + 0.1 + 0.5 * 0.1 + 0.5 * 0.1) / 3.0)
    assert not filled.slip[0, 0, 1]


def test_a_table_of_a_history_counts_elements_by_frame() -> None:
    table = history(field([0, 1, 2], [5]), field([1], [])).to_dataframe()
    assert table["elements_in_contact"].tolist() == [3, 1]
    assert table["elements_in_slip"].tolist() == [1, 0]
    assert table.index.tolist() == [0.5, 0.7]
