"""What a grid does not resolve is said."""

import numpy as np
import pytest

from slipcore.contact.elasticity.grid import Grid
from slipcore.contact.solver.resolution import summary, unresolved


def disk(radius: float, cells: int = 40) -> np.ndarray:
    x, y = Grid.square(cells, float(cells)).points()
    return np.hypot(x, y) < radius


def test_a_wide_contact_with_a_wide_slip_zone_is_resolved() -> None:
    assert unresolved(disk(15.0), disk(15.0) & ~disk(12.0), sheared=True) == ()


def test_no_contact_is_nothing_to_say() -> None:
    nothing = np.zeros((4, 4), dtype=bool)
    assert unresolved(nothing, nothing, sheared=False) == ()


@pytest.mark.parametrize(
    ("contact", "at_limit", "sheared", "said"),
    [
        (disk(4.0), disk(0.0), False, "radius spans 4.1 cells"),
        (disk(15.0), disk(0.0), True, "slip zone spans 0.0 cells"),
        (disk(15.0), disk(15.0) & ~disk(14.5), True, "slip zone spans 0.8 cells"),
        (disk(30.0), disk(0.0), False, "edge of the grid"),
    ],
)
def test_what_is_too_small_is_named(contact, at_limit, sheared: bool, said: str) -> None:
    (sentence,) = unresolved(contact, at_limit, sheared)
    assert said in sentence


@pytest.mark.parametrize("x", [-20, 0, 20])
@pytest.mark.parametrize("y", [-20, 0, 20])
def test_a_contact_at_any_edge_of_the_grid_is_said_to_reach_it(x: int, y: int) -> None:
    contact = np.roll(np.pad(disk(12.0), 20), (x, y), (0, 1))[20:-20, 20:-20]
    said = unresolved(contact, np.zeros_like(contact), sheared=False)
    assert any("edge of the grid" in sentence for sentence in said) == bool(x or y)


def test_a_contact_that_only_sticks_needs_no_slip_zone() -> None:
    assert unresolved(disk(15.0), disk(0.0), sheared=False) == ()


def test_a_summary_counts_the_steps_of_each_kind() -> None:
    thin = unresolved(disk(15.0), disk(0.0), sheared=True)
    small = unresolved(disk(4.0), disk(0.0), sheared=True)
    assert summary([(), thin, small]) == "the slip zone, in 2 of 3 steps; the contact's radius, in 1 of 3 steps"
    assert summary([(), ()]) == "nothing"
