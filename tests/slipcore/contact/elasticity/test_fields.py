"""Sums over fields of cells."""

import numpy as np

from slipcore.contact.elasticity.fields import lengths, rigid_displacement


def test_lengths_are_those_of_numpy() -> None:
    field = np.random.default_rng(0).normal(size=(2, 7, 9)) * 10.0 ** np.arange(-9, 0)
    np.testing.assert_allclose(lengths(field), np.hypot(*field), rtol=1e-15)


def test_rigid_motions_turn_about_the_origin() -> None:
    arm = np.random.default_rng(1).normal(size=(2, 3, 4))
    moved = rigid_displacement(arm, np.array([0.3, -0.2, 2.0]))
    np.testing.assert_allclose(moved, [0.3 - 2.0 * arm[1], -0.2 + 2.0 * arm[0]], rtol=1e-14)
