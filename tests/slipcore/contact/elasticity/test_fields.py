"""Sums over fields of cells."""

import numpy as np

from slipcore.contact.elasticity.fields import largest, lengths, rigid_displacement
from slipcore.contact.elasticity.grid import Grid, on_whole


def test_lengths_are_those_of_numpy() -> None:
    field = np.random.default_rng(0).normal(size=(2, 7, 9)) * 10.0 ** np.arange(-9, 0)
    np.testing.assert_allclose(lengths(field), np.hypot(*field), rtol=1e-15)


def test_rigid_motions_turn_about_the_origin() -> None:
    arm = np.random.default_rng(1).normal(size=(2, 3, 4))
    moved = rigid_displacement(arm, np.array([0.3, -0.2, 2.0]))
    np.testing.assert_allclose(moved, [0.3 - 2.0 * arm[1], -0.2 + 2.0 * arm[0]], rtol=1e-14)


def test_the_largest_number_is_found_by_its_size_and_nan_before_all() -> None:
    field = np.random.default_rng(3).normal(size=(2, 7, 9))
    assert largest(field) == np.abs(field).max()
    for value in (-np.inf, np.inf, np.nan, -np.nan):
        field[1, 3, 4] = value
        np.testing.assert_equal(largest(field), np.abs(value))
    assert largest(np.array([-0.0, -5e-324])) == 5e-324


def test_a_part_of_a_field_lies_in_its_box_of_the_whole_grid() -> None:
    grid, box = Grid((6, 8), (1.0, 1.0)), (slice(2, 5), slice(1, 4))
    part = np.ones((2, 3, 3))
    whole = on_whole(grid, box, part)
    assert whole.shape == (2, 6, 8)
    assert whole.sum() == 18.0
    np.testing.assert_array_equal(whole[:, *box], part)
    assert on_whole(grid, box, part > 0.0).dtype == bool
