import numpy as np

from slipcore.slip_state import slip_events


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
