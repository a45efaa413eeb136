"""Compiled loops over cells against plain numpy."""

import numpy as np

from slipcore.contact.elasticity.fields import inner, resultants, rigid_displacement
from slipcore.contact.solver import tangent_space as compiled
from slipcore.contact.solver.tangent_space import OUTSIDE, SLIP, STICK, TangentSpace

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
    xx, xy, yy = space.projector
    return np.stack((xx * move[0] + xy * move[1], xy * move[0] + yy * move[1]))


def flat(field: np.ndarray) -> np.ndarray:
    return field.reshape(len(field), -1)


def test_cells_stick_inside_their_disk_and_slide_on_it() -> None:
    traction, slip, limit, arm, _ = case()
    space = TangentSpace(traction, slip, limit, 0.5, arm, GIVEN)
    point = np.hypot(*(traction - 0.5 * slip))
    np.testing.assert_array_equal(space.state == OUTSIDE, limit <= 0.0)
    np.testing.assert_array_equal(space.state == SLIP, (point > limit) & (limit > 0.0))
    assert (space.state == STICK).any()
    sliding = space.state == SLIP
    np.testing.assert_allclose(np.hypot(*(traction + space.onto_circle))[sliding], limit[sliding], rtol=1e-14)
    normal = (traction + space.onto_circle) / np.where(limit > 0.0, limit, 1.0)
    opposed = np.maximum(-(slip * normal).sum(axis=0), 0.0) / np.where(limit > 0.0, limit, 1.0)
    np.testing.assert_allclose(space.curvature[sliding], opposed[sliding], rtol=1e-13)


def test_projection_keeps_what_sticks_and_only_turns_what_slides() -> None:
    traction, slip, limit, arm, move = case()
    space = TangentSpace(traction, slip, limit, 0.5, arm, GIVEN)
    kept, sliding = tangent(space, move), space.state == SLIP
    np.testing.assert_array_equal(kept[:, space.state == STICK], move[:, space.state == STICK])
    np.testing.assert_array_equal(kept[:, space.state == OUTSIDE], 0.0)
    normal = (traction + space.onto_circle)[:, sliding] / limit[sliding]
    expected = move[:, sliding] - (move[:, sliding] * normal).sum(axis=0) * normal
    np.testing.assert_allclose(kept[:, sliding], expected, rtol=0.0, atol=1e-13)


def test_outward_tractions_of_a_solution_are_a_gradient_step() -> None:
    traction, slip, limit, arm, _ = case()
    sliding = np.zeros(limit.shape, dtype=bool)
    sliding[::2] = True
    traction = np.where(sliding, limit * traction / np.hypot(*traction).clip(min=1e-300), 0.9 * traction)
    slip = np.where(sliding, -0.7 * traction, 0.0)
    space = TangentSpace(traction, slip, limit, 0.5, arm, GIVEN)
    np.testing.assert_allclose(space.outward(traction), traction - 0.5 * slip, rtol=1e-13)


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
    compiled._subtract_rigid(flat(space.projector), flat(arm), motion, flat(move))
    np.testing.assert_allclose(move, expected, rtol=0.0, atol=1e-14)


def test_stiffening_restricts_and_adds_the_curvature() -> None:
    traction, slip, limit, arm, answer = case(4)
    space = TangentSpace(traction, slip, limit, 0.5, arm, GIVEN)
    direction = space.balanced(slip.copy())
    expected = tangent(space, answer) + np.where(space.state == SLIP, space.curvature, 0.0) * direction
    product = compiled._stiffen(flat(space.projector), space.curvature.ravel(), flat(direction), flat(answer))
    np.testing.assert_allclose(answer, expected, rtol=0.0, atol=1e-13)
    np.testing.assert_allclose(product, (direction * expected).sum(), rtol=1e-12)
    np.testing.assert_allclose(inner(direction, expected), product, rtol=1e-12)


def test_gram_holds_the_products_of_rigid_motions() -> None:
    traction, slip, limit, arm, _ = case(5)
    space = TangentSpace(traction, slip, limit, 0.5, arm, GIVEN)
    motions = [tangent(space, rigid_displacement(arm, e)) for e in np.eye(3)]
    expected = np.array([[(a * b).sum() for b in motions] for a in motions])
    np.testing.assert_allclose(compiled._gram(flat(space.projector), flat(arm)), expected, rtol=1e-12, atol=1e-12)


def test_advancing_moves_updates_the_residual_and_scales_it() -> None:
    traction, slip, limit, arm, answer = case(6)
    space = TangentSpace(traction, slip, limit, 0.5, arm, GIVEN)
    direction, residual = space.balanced(slip.copy()), space.balanced(np.ones_like(slip))
    move, before, response = np.zeros_like(slip), residual.copy(), tangent(space, answer) + space.curvature * direction
    step = 0.25 / inner(direction, response)
    compiled._advance(space.flat, flat(move), flat(residual), flat(direction), flat(answer), 0.25)
    np.testing.assert_allclose(move, step * direction, rtol=1e-12)
    expected = space.balanced(before + step * response)
    np.testing.assert_allclose(residual, expected, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(answer, space.scale * residual, rtol=1e-14)


def test_improving_scales_balances_and_multiplies() -> None:
    traction, slip, limit, arm, improved = case(7)
    space = TangentSpace(traction, slip, limit, 0.5, arm, GIVEN)
    expected = space.balanced(space.scale * improved)
    product = compiled._improve(space.flat, flat(slip), flat(improved))
    np.testing.assert_allclose(improved, expected, rtol=0.0, atol=1e-13)
    np.testing.assert_allclose(product, (slip * expected).sum(), rtol=1e-12)


def test_the_inverse_of_a_singular_gram_is_its_pseudo_inverse() -> None:
    gram = np.diag([2.0, 0.0, 1e-3])
    np.testing.assert_allclose(compiled._inverse(gram), np.linalg.pinv(gram), rtol=1e-14)
