"""FFT convolution against the sum that it stands for."""

import numpy as np
import pytest

from slipcore.contact.elasticity.grid import Grid, bounding_box
from slipcore.contact.elasticity.influence import HalfSpace
from slipcore.contact.elasticity.operator import ElasticOperator, Operators
from slipcore.contact.elasticity.transform import convolve

GRID = Grid((7, 10), (1.0, 1.5))
BODY = HalfSpace(1.3, 0.3)


def direct(component: str, source: np.ndarray, odd_y: bool = False, odd_x: bool = False) -> np.ndarray:
    kernel = BODY.influence(component, GRID)
    ny, nx = GRID.shape
    result = np.zeros(GRID.shape)
    for i in range(ny):
        for j in range(nx):
            dy, dx = i - np.arange(ny)[:, None], j - np.arange(nx)[None, :]
            sign = np.where(odd_y, np.sign(dy), 1.0) * np.where(odd_x, np.sign(dx), 1.0)
            result[i, j] = (sign * kernel[np.abs(dy), np.abs(dx)] * source).sum()
    return result


def test_convolution_is_the_sum_over_cells() -> None:
    operator = Operators((BODY,)).on(GRID)
    rng = np.random.default_rng(1)
    p, q = rng.normal(size=GRID.shape), rng.normal(size=(2, *GRID.shape))
    tolerance = {"rtol": 0.0, "atol": 1e-13}  # a hundred roundings of numbers near 1
    np.testing.assert_allclose(operator.normal(p), direct("nn", p), **tolerance)
    cross = [direct("xy", part, odd_y=True, odd_x=True) for part in q]
    expected = np.stack((direct("xx", q[0]) + cross[1], direct("yy", q[1]) + cross[0]))
    np.testing.assert_allclose(operator.tangential(q), expected, **tolerance)
    lift = direct("zx", q[0], odd_x=True) + direct("zy", q[1], odd_y=True)
    np.testing.assert_allclose(operator.normal_by_traction(q), lift, **tolerance)
    spread = -np.stack((direct("zx", p, odd_x=True), direct("zy", p, odd_y=True)))
    np.testing.assert_allclose(operator.tangential_by_pressure(p), spread, **tolerance)


def test_work_is_reciprocal() -> None:
    operator = Operators((BODY,)).on(GRID)
    rng = np.random.default_rng(2)
    p, q = rng.normal(size=GRID.shape), rng.normal(size=(2, *GRID.shape))
    given = (p * operator.normal_by_traction(q)).sum()
    taken = (q * operator.tangential_by_pressure(p)).sum()
    assert given == pytest.approx(taken, rel=1e-12)  # Betti: symmetric, since x is odd in the kernel too


def test_operators_are_made_once_and_counted_together() -> None:
    operators = Operators((BODY,))
    assert operators.on(GRID) is operators.on(Grid(GRID.shape, GRID.pitch, (3.0, 4.0)))
    operators.on(GRID).normal(np.zeros(GRID.shape))
    operators.on(Grid((3, 3), (1.0, 1.0))).tangential(np.zeros((2, 3, 3)))
    assert (operators.count.normal, operators.count.tangential, operators.count.coupling) == (1, 1, 0)


def dense(function, shape: tuple[int, ...]) -> np.ndarray:
    size = int(np.prod(shape))
    return np.stack([function(column.reshape(shape)).ravel() for column in np.eye(size)], axis=1)


def test_preconditioners_are_positive_and_tame_the_spectrum() -> None:
    grid = Grid.square(10, 1.0)
    operator = Operators((BODY,)).on(grid)
    for forward, inverse, shape in (
        (operator.normal, operator.normal_inverse, grid.shape),
        (operator.tangential, operator.tangential_inverse, (2, *grid.shape)),
    ):
        plain, tamed = dense(forward, shape), dense(lambda f, a=forward, b=inverse: b(a(f)), shape)
        np.testing.assert_allclose(plain, plain.T, rtol=0.0, atol=1e-14)
        values = np.linalg.eigvals(tamed).real
        assert values.min() > 0.0
        assert values.max() / values.min() < 0.5 * np.linalg.cond(plain)


def test_boxes_contain_and_round_up() -> None:
    mask = np.zeros((20, 30), dtype=bool)
    mask[17:19, 4:9] = True
    assert bounding_box(mask) == (slice(17, 19), slice(4, 9))
    assert bounding_box(mask, 4) == (slice(16, 20), slice(4, 12))
    part = Grid((20, 30), (1.0, 1.0)).part(bounding_box(mask))
    np.testing.assert_array_equal(part.x, Grid((20, 30), (1.0, 1.0)).x[4:9])


def test_a_box_takes_its_kernels_from_the_whole() -> None:
    whole = Grid.square(50, 5e-3)
    part = Grid((22, 31), whole.pitch)
    field = np.random.default_rng(4).normal(size=(2, *part.shape))
    apart, within = Operators((BODY,)).on(part), Operators((BODY,), whole=whole).on(part)
    np.testing.assert_array_equal(within.tangential(field), apart.tangential(field))
    np.testing.assert_array_equal(within.tangential_inverse(field), apart.tangential_inverse(field))
    np.testing.assert_array_equal(within.normal_by_traction(field), apart.normal_by_traction(field))
    assert within.source is not None
    assert Operators((BODY,), whole=whole).on(Grid.square(20, 5e-3)).source is None  # another pitch
    assert Operators((BODY,), whole=whole).on(Grid((64, 20), whole.pitch)).source is None  # larger


def test_single_precision_is_in_units_of_a_cell_on_itself() -> None:
    operator = ElasticOperator((HalfSpace.from_young(1e6, 0.3),), Grid((17, 20), (1e-4, 1e-4)))
    own, field = operator.influence("xx")[0, 0], np.random.default_rng(0).normal(size=(2, 17, 20))
    cases = (
        (operator.tangential_single, operator.tangential(field) / own),
        (
            operator.tangential_inverse.single,
            operator.tangential_inverse(field) * own,
        ),
    )
    for compiled, expected in cases:
        result = np.empty(field.shape, dtype=np.float32)
        convolve(field.astype(np.float32), result, compiled)
        np.testing.assert_allclose(result, expected, rtol=0.0, atol=1e-5 * np.abs(expected).max())
