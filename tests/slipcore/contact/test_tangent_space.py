"""Compiled loops over cells against plain numpy."""

import numpy as np

from slipcore.contact import tangent_space as compiled
from slipcore.contact.fields import inner, resultants, rigid_displacement
from slipcore.contact.tangent_space import OUTSIDE, SLIP, STICK, TangentSpace

GIVEN = np.ones(3, dtype=bool)


def case(seed: int = 0) -> tuple[np.ndarray, ...]:
    rng = np.random.default_rng(seed)
    limit = np.maximum(rng.uniform(-0.3, 1.0, size=(9, 11)), 0.0)
    traction = 0.6 * rng.normal(size=(2, 9, 11))
    size = np.hypot(*traction)
    traction *= np.minimum(1.0, limit / size)
    slip, arm = rng.normal(size=(2, 9, 11)), rng.normal(size=(2, 9, 11))
    return traction, slip, limit, arm, rng.normal(size=(2, 9, 11))


def tangent(space: TangentSpace, move: np.ndarray) -> np.ndarray:
    """Restriction to the space, in plain numpy."""
    along = (move * space.normal).sum(axis=0)
    return np.where(space.state == OUTSIDE, 0.0, move - np.where(space.state == SLIP, along, 0.0) * space.normal)


def test_cells_stick_inside_their_disk_and_slide_on_it() -> None:
    traction, slip, limit, arm, _ = case()
    space = TangentSpace(traction, slip, limit, 0.5, arm, GIVEN)
    wish = np.hypot(*(traction - 0.5 * slip))
    np.testing.assert_array_equal(space.state == OUTSIDE, limit <= 0.0)
    np.testing.assert_array_equal(space.state == SLIP, (wish > limit) & (limit > 0.0))
    assert (space.state == STICK).any()
    sliding = space.state == SLIP
    np.testing.assert_allclose(np.hypot(*(traction + space.onto_circle))[sliding], limit[sliding], rtol=1e-14)
    np.testing.assert_allclose(np.hypot(*space.normal)[sliding], 1.0, rtol=1e-14)
    opposed = np.maximum(-(slip * space.normal).sum(axis=0), 0.0) / np.where(limit > 0.0, limit, 1.0)
    np.testing.assert_allclose(space.curvature[sliding], opposed[sliding], rtol=1e-13)


def test_balanced_moves_lie_in_the_space_and_carry_no_load() -> None:
    traction, slip, limit, arm, move = case(1)
    space = TangentSpace(traction, slip, limit, 0.5, arm, GIVEN)
    balanced = space.balanced(move.copy())
    np.testing.assert_allclose(balanced, tangent(space, balanced), rtol=0.0, atol=1e-14)
    np.testing.assert_allclose(resultants(balanced, arm), 0.0, atol=1e-12)
    np.testing.assert_allclose(space.balanced(balanced.copy()), balanced, rtol=0.0, atol=1e-13)


def test_balancing_adds_just_what_is_lacking() -> None:
    traction, slip, limit, arm, _ = case(2)
    space = TangentSpace(traction, slip, limit, 0.5, arm, GIVEN)
    lacking = np.array([0.3, -0.2, 0.7])
    np.testing.assert_allclose(resultants(space.balancing(lacking), arm), lacking, rtol=1e-11)


def test_rigid_motions_are_subtracted_within_the_space() -> None:
    traction, slip, limit, arm, move = case(3)
    space = TangentSpace(traction, slip, limit, 0.5, arm, GIVEN)
    motion = np.array([0.4, -0.1, 0.9])
    expected = move - tangent(space, rigid_displacement(arm, motion))
    compiled._subtract_rigid(space.state, space.normal, arm, motion, move)
    np.testing.assert_allclose(move, expected, rtol=0.0, atol=1e-14)


def test_stiffening_restricts_and_adds_the_curvature() -> None:
    traction, slip, limit, arm, answer = case(4)
    space = TangentSpace(traction, slip, limit, 0.5, arm, GIVEN)
    direction = space.balanced(slip.copy())
    expected = tangent(space, answer) + np.where(space.state == SLIP, space.curvature, 0.0) * direction
    product = compiled._stiffen(space.state, space.normal, space.curvature, direction, answer)
    np.testing.assert_allclose(answer, expected, rtol=0.0, atol=1e-13)
    np.testing.assert_allclose(product, (direction * expected).sum(), rtol=1e-12)
    np.testing.assert_allclose(inner(direction, expected), product, rtol=1e-12)


def test_gram_holds_the_products_of_rigid_motions() -> None:
    traction, slip, limit, arm, _ = case(5)
    space = TangentSpace(traction, slip, limit, 0.5, arm, GIVEN)
    motions = [tangent(space, rigid_displacement(arm, e)) for e in np.eye(3)]
    expected = np.array([[(a * b).sum() for b in motions] for a in motions])
    np.testing.assert_allclose(compiled._gram(space.state, space.normal, arm), expected, rtol=1e-12, atol=1e-12)


def test_advancing_moves_and_updates_the_residual() -> None:
    _, slip, _, _, answer = case(6)
    move, residual = np.zeros_like(slip), np.ones_like(slip)
    compiled._advance(move, residual, slip, answer, 0.25)
    np.testing.assert_allclose(move, 0.25 * slip, rtol=1e-15)
    np.testing.assert_allclose(residual, 1.0 + 0.25 * answer, rtol=1e-15)
