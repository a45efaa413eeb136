"""When nothing touches, by hand."""

import numpy as np
import pytest

from slipcore.checks.rest import frames_at_rest, touched_elements
from tests.slipcore.checks.by_hand import log, over_time, subject

CONTACT = np.zeros((20, 4, 3), bool)
CONTACT[6:, 1:3] = True
PRESSING = over_time(np.where(np.arange(20) < 6, 0.0, -0.1), 2)


def pressed(depth: np.ndarray) -> np.ndarray:
    return over_time(depth, 2)


@pytest.mark.parametrize(("at_rest", "is_rest"), [(0.029, True), (0.031, False)])
def test_markers_rest_up_to_three_per_cent_of_their_largest_displacement(at_rest: float, is_rest: bool) -> None:
    depth = np.where(np.arange(20) < 5, -at_rest, -1.0) * 1e-4
    found = frames_at_rest(subject(log(pressed(depth), PRESSING), CONTACT))
    np.testing.assert_array_equal(found, (np.arange(20) < 5) & is_rest)


@pytest.mark.parametrize("count", [3, 4])
def test_fewer_than_four_frames_are_no_rest(count: int) -> None:
    depth = np.where(np.arange(20) < count, 0.0, -1e-4)
    assert frames_at_rest(subject(log(pressed(depth), PRESSING), CONTACT)).sum() == (4 if count == 4 else 0)


def test_markers_that_never_move_do_not_rest_and_what_nothing_touches_does_not_either() -> None:
    assert not frames_at_rest(subject(log(0.0, PRESSING), CONTACT)).any()
    assert not frames_at_rest(subject(log(pressed(np.linspace(0.0, -1e-4, 20)), PRESSING), contact=False)).any()


def test_elements_are_touched_that_touch_in_most_of_the_frames_held() -> None:
    """Fourteen frames are held: seven of them are not most."""
    contact = np.zeros((20, 4, 3), bool)
    contact[6:13, 0, 0] = contact[6:14, 0, 1] = contact[:6, 0, 2] = True
    touched = touched_elements(subject(log(0.0, PRESSING), contact))
    assert np.argwhere(touched).tolist() == [[0, 1]]
    assert not touched_elements(subject(log(), contact)).any()


def test_of_markers_in_the_plane_those_frames_rest_in_which_elements_press_least() -> None:
    """They stay where they are for ten frames, in the last five of which they are pressed already."""
    along = over_time(np.where(np.arange(20) < 10, 0.0, 1e-4), 0)
    force = over_time(np.where(np.arange(20) < 5, -1e-4, -0.1), 2)
    found = frames_at_rest(subject(log(along, force), CONTACT))
    np.testing.assert_array_equal(found, np.arange(20) < 5)
