"""Ways and runs of plateaus by hand, as plain Python."""

from inspect import unwrap

import numpy as np
import pytest

from slipcore.defaults import PatchOptions
from slipcore.patch.motion import PatchMotion
from slipcore.patch.plateau import _is_flat, _next_run, _travel, find_plateaus


def test_a_way_adds_up_by_mean_speeds() -> None:
    time, speed = np.array([0.0, 1.0, 3.0, 3.5]), np.array([2.0, 4.0, 0.0, 6.0])
    np.testing.assert_allclose(unwrap(_travel)(time, speed), [0.0, 3.0, 7.0, 8.5])


@pytest.mark.parametrize(
    ("begin", "end", "run"),
    [(0, 7, (1, 3)), (2, 7, (2, 3)), (3, 7, (5, 7)), (3, 6, (5, 6)), (3, 5, (5, 5)), (7, 7, (7, 7))],
)
def test_the_next_run_is_of_chosen_frames_on_end(begin: int, end: int, run: tuple[int, int]) -> None:
    chosen = np.array([False, True, True, False, False, True, True])
    assert unwrap(_next_run)(chosen, begin, end) == run


@pytest.mark.parametrize(("grows", "flat"), [(0.19, True), (0.21, False), (-5.0, True)])
def test_a_load_is_flat_that_grows_by_no_more_than_a_share_of_itself_over_a_pitch(grows: float, flat: bool) -> None:
    """Its mean is 2, and a tenth of it may come a pitch."""
    travel = np.linspace(0.0, 1.0, 9)
    assert unwrap(_is_flat)(travel, 2.0 + grows * (travel - 0.5), 0.1) == flat


@pytest.mark.parametrize(
    ("ratio", "marked"),
    [(0.5, range(40)), (0.0, range(0)), (np.nan, range(0)), ([np.nan] * 20 + [0.5] * 20, range(20, 40))],
)
def test_a_load_that_is_none_or_not_known_stands_on_no_plateau(ratio: float | list[float], marked: range) -> None:
    """A body that turns by 4 mm a second over elements of 1 mm."""
    time, every = np.arange(40) / 30.0, np.ones(40, bool)
    motion = PatchMotion(np.zeros((40, 2)), np.full(40, 4e-3), ~every, every, ~every)
    ratios, bounds = np.broadcast_to(ratio, 40).copy(), np.array([0, 40])
    found = find_plateaus(time, bounds, motion, ratios, np.zeros((40, 2)), every, 1e-3, PatchOptions())
    assert np.flatnonzero(found.any).tolist() == list(marked)
