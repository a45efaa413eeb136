"""Compiled loops over cells against plain numpy."""

import numpy as np
import pytest

from slipcore.contact.elasticity.fields import inner, resultants, rigid_displacement
from slipcore.contact.elasticity.grid import Grid
from slipcore.contact.elasticity.operator import ElasticOperator
from slipcore.contact.elasticity.transform import Compiled
from slipcore.contact.solver import tangent_space as compiled
from tests.slipcore.contact.solver.following import body

GIVEN = np.ones(3, dtype=bool)


class Found:
    """What ``survey`` finds, in the shape of the grid."""

    def __init__(
        self, traction: np.ndarray, slip: np.ndarray, limit: np.ndarray, stiffness: float, arm: np.ndarray
    ) -> None:
        fields, here = np.empty((compiled.FIELDS, *limit.shape)), (flat(traction), flat(slip), limit.ravel(), stiffness)
        self.arm, self.inverse_gram = arm, compiled.survey(here, (flat(arm), GIVEN), flat(fields))
        self.projector, self.onto_circle, self.curvature, self.scale = fields[:3], fields[3:5], fields[5], fields[6]
        directions = self.projector[0] + self.projector[2]
        self.outside, self.sticks = directions == 0.0, directions == 2.0
        self.slides = ~self.outside & ~self.sticks

    def balanced(self, move: np.ndarray) -> np.ndarray:
        """The part of a move that lies in the space and has no resultant, in plain numpy."""
        kept = tangent(self, move)
        return kept - tangent(self, rigid_displacement(self.arm, self.inverse_gram @ resultants(kept, self.arm)))

    @property
    def space(self) -> compiled.Space:
        return flat(self.projector), flat(self.arm), self.inverse_gram, self.curvature.ravel(), self.scale.ravel()


def case(seed: int = 0) -> tuple[np.ndarray, ...]:
    rng = np.random.default_rng(seed)
    limit = np.maximum(rng.uniform(-0.3, 1.0, size=(9, 11)), 0.0)
    traction = 0.6 * rng.normal(size=(2, 9, 11))
    size = np.hypot(*traction)
    traction *= np.minimum(1.0, limit / size)
    slip, arm = rng.normal(size=(2, 9, 11)), rng.normal(size=(2, 9, 11))
    return traction, slip, limit, arm, rng.normal(size=(2, 9, 11))


def tangent(space: Found, move: np.ndarray) -> np.ndarray:
    """Restriction to the space, in plain numpy."""
    xx, xy, yy = space.projector
    return np.stack((xx * move[0] + xy * move[1], xy * move[0] + yy * move[1]))


def flat(field: np.ndarray) -> np.ndarray:
    return field.reshape(len(field), -1)


def single(field: np.ndarray) -> np.ndarray:
    return flat(field).astype(np.float32)


def by(operator: ElasticOperator) -> tuple[Compiled, Compiled, Compiled]:
    return operator.tangential_compiled, operator.tangential_single, operator.tangential_inverse.single


def test_cells_stick_inside_their_disk_and_slide_on_it() -> None:
    traction, slip, limit, arm, _ = case()
    space = Found(traction, slip, limit, 0.5, arm)
    point = np.hypot(*(traction - 0.5 * slip))
    np.testing.assert_array_equal(space.outside, limit <= 0.0)
    np.testing.assert_array_equal(space.slides, (point > limit) & (limit > 0.0))
    assert (space.sticks).any()
    sliding = space.slides
    np.testing.assert_allclose(np.hypot(*(traction + space.onto_circle))[sliding], limit[sliding], rtol=1e-14)
    normal = (traction + space.onto_circle) / np.where(limit > 0.0, limit, 1.0)
    opposed = np.maximum(-(slip * normal).sum(axis=0), 0.0) / np.where(limit > 0.0, limit, 1.0)
    np.testing.assert_allclose(space.curvature[sliding], opposed[sliding], rtol=1e-13)


def test_projection_keeps_what_sticks_and_only_turns_what_slides() -> None:
    traction, slip, limit, arm, move = case()
    space = Found(traction, slip, limit, 0.5, arm)
    kept, sliding = tangent(space, move), space.slides
    np.testing.assert_array_equal(kept[:, space.sticks], move[:, space.sticks])
    np.testing.assert_array_equal(kept[:, space.outside], 0.0)
    normal = (traction + space.onto_circle)[:, sliding] / limit[sliding]
    expected = move[:, sliding] - (move[:, sliding] * normal).sum(axis=0) * normal
    np.testing.assert_allclose(kept[:, sliding], expected, rtol=0.0, atol=1e-13)


def test_outward_tractions_of_a_solution_are_a_gradient_step() -> None:
    traction, slip, limit, arm, _ = case()
    sliding = np.zeros(limit.shape, dtype=bool)
    sliding[::2] = True
    traction = np.where(sliding, limit * traction / np.hypot(*traction).clip(min=1e-300), 0.9 * traction)
    slip = np.where(sliding, -0.7 * traction, 0.0)
    space = Found(traction, slip, limit, 0.5, arm)
    half, point = 0.5 * traction, np.empty_like(traction)
    compiled.outward(flat(half), flat(half), space.scale.ravel(), flat(point))
    np.testing.assert_allclose(point, traction - 0.5 * slip, rtol=1e-13)


def test_the_first_part_of_a_move_leads_onto_the_circles_and_to_the_load() -> None:
    traction, slip, limit, arm, _ = case(2)
    space, target = Found(traction, slip, limit, 0.5, arm), np.array([0.3, -0.2, 0.7])
    operator = ElasticOperator((body(),), Grid(limit.shape, (1.0, 1.0)))
    fields = traction, slip, space.onto_circle
    move, taken = compiled.newton_move(space.space, fields, target, by(operator), (1.0, np.inf, 0.05, 0))
    assert taken == (0, 0, 0)
    np.testing.assert_allclose(resultants(traction + move, arm), target, rtol=1e-11)
    balancing = move - space.onto_circle
    np.testing.assert_allclose(balancing, tangent(space, balancing), rtol=0.0, atol=1e-13)


def test_newton_moves_take_the_slip_from_the_space() -> None:
    traction, slip, limit, arm, _ = case(8)
    operator, target = ElasticOperator((body(),), Grid(limit.shape, (1.0, 1.0))), np.array([0.1, 0.2, -0.3])
    stiffness = 1.0 / operator.influence("xx")[0, 0]
    slip *= 0.5 / stiffness
    space = Found(traction, slip, limit, stiffness, arm)
    fields = traction, slip, space.onto_circle
    bounds = stiffness, 0.0, 1e-4, 100
    move, (applied, singles, inverted) = compiled.newton_move(space.space, fields, target, by(operator), bounds)
    assert applied - 1 == inverted == singles > 2
    left = space.balanced(slip + operator.tangential(move) + space.curvature * move)
    assert np.abs(left).max() <= 1e-3 * np.abs(space.balanced(slip)).max()
    np.testing.assert_allclose(resultants(traction + move, arm), target, rtol=0.0, atol=1e-5)


def test_rigid_motions_are_subtracted_within_the_space() -> None:
    traction, slip, limit, arm, move = case(3)
    space = Found(traction, slip, limit, 0.5, arm)
    motion = np.array([0.4, -0.1, 0.9])
    expected = move - tangent(space, rigid_displacement(arm, motion))
    compiled._subtract_rigid(flat(space.projector), flat(arm), motion, flat(move))
    np.testing.assert_allclose(move, expected, rtol=0.0, atol=1e-14)


def test_stiffening_restricts_and_adds_the_curvature() -> None:
    traction, slip, limit, arm, answer = case(4)
    space = Found(traction, slip, limit, 0.5, arm)
    direction = space.balanced(slip)
    expected = tangent(space, answer) + space.curvature * direction
    projector, places, _, curvature, _ = compiled._scaled(space.space, 1.0)
    image = single(answer)
    product, sums = compiled._stiffen(projector, places, curvature, single(direction), image)
    np.testing.assert_allclose(image, flat(expected), rtol=0.0, atol=1e-5)
    np.testing.assert_allclose(product, inner(direction, expected), rtol=1e-5)
    np.testing.assert_allclose(sums, resultants(expected, arm), rtol=0.0, atol=1e-4)


def test_gram_holds_the_products_of_rigid_motions() -> None:
    traction, slip, limit, arm, _ = case(5)
    space = Found(traction, slip, limit, 0.5, arm)
    motions = [tangent(space, rigid_displacement(arm, e)) for e in np.eye(3)]
    expected = np.array([[(a * b).sum() for b in motions] for a in motions])
    np.testing.assert_allclose(compiled._gram(flat(space.projector), flat(arm)), expected, rtol=1e-12, atol=1e-12)


def test_advancing_moves_updates_the_residual_and_scales_it() -> None:
    traction, slip, limit, arm, answer = case(6)
    space = Found(traction, slip, limit, 0.5, arm)
    direction, residual = space.balanced(slip), space.balanced(np.ones_like(slip))
    response = tangent(space, answer) + space.curvature * direction
    step = 0.25 / inner(direction, response)
    move, image, left = single(np.zeros_like(slip)), single(answer), single(residual)
    square = compiled._advance(compiled._scaled(space.space, 1.0), move, left, single(direction), image, 0.25)
    assert square == pytest.approx((left.astype(float) ** 2).sum(), rel=1e-5)
    np.testing.assert_allclose(move, flat(step * direction), rtol=1e-4, atol=1e-6)
    np.testing.assert_allclose(left, flat(space.balanced(residual + step * response)), rtol=0.0, atol=1e-4)
    np.testing.assert_allclose(image, space.scale.ravel() * left, rtol=1e-6)


def test_improving_scales_restricts_and_multiplies_and_turning_balances() -> None:
    traction, slip, limit, arm, improved = case(7)
    space = Found(traction, slip, limit, 0.5, arm)
    residual, direction, better = space.balanced(slip), single(improved), single(improved)
    expected, scaled = space.balanced(space.scale * improved), compiled._scaled(space.space, 1.0)
    product, motion = compiled._improve(scaled, single(residual), better)
    np.testing.assert_allclose(product, inner(residual, expected), rtol=1e-5)
    compiled._turn(scaled[0], scaled[1], motion, direction, better, 0.3)
    np.testing.assert_allclose(direction, flat(0.3 * improved - expected), rtol=0.0, atol=1e-5)


def test_single_precision_holds_any_curvature() -> None:
    traction, slip, limit, arm, _ = case(8)
    space = Found(traction, slip, limit, 0.5, arm)
    space.curvature[space.slides] = 1e300
    space.scale[space.slides] = 1e-150
    _, _, _, curvature, scale = compiled._scaled(space.space, 0.5)
    assert np.isfinite(curvature).all()
    assert (scale > 0.0).all()
    sliding = space.slides.ravel()
    np.testing.assert_allclose((curvature * scale**2)[sliding], 1.0, rtol=1e-5)


def test_the_inverse_of_a_singular_gram_is_its_pseudo_inverse() -> None:
    gram = np.diag([2.0, 0.0, 1e-3])
    np.testing.assert_allclose(compiled._inverse(gram), np.linalg.pinv(gram), rtol=1e-14)


def test_the_inverse_of_a_gram_is_that_of_numpy_up_to_where_a_motion_leaves_the_space() -> None:
    spread = np.random.default_rng(9).normal(size=(3, 3))
    for last in (1.0, 1e-3, 1e-5, 1e-7, 1e-9):
        gram = spread.T @ np.diag([2.0, 1.0, last]) @ spread
        exact = np.linalg.inv(gram)
        np.testing.assert_allclose(compiled._inverse(gram), exact, rtol=0.0, atol=1e-14 / last * np.abs(exact).max())
