"""Convolutions by transforms in kept work space."""

import numpy as np
import pytest

from slipcore.contact.elasticity.transform import Convolution, padded_lengths, symbols
from slipcore.frames import FloatArray

SHAPES = [(5, 8), (8, 5), (1, 7), (16, 16), (17, 9), (20, 27), (33, 40)]


def even(quadrant: FloatArray, odd_y: bool, odd_x: bool) -> FloatArray:
    """An influence at all offsets [2 ny − 1, 2 nx − 1], from its first quadrant."""
    below = (-1.0 if odd_y else 1.0) * quadrant[:0:-1]
    half = np.concatenate((below, quadrant))
    return np.concatenate(((-1.0 if odd_x else 1.0) * half[:, :0:-1], half), axis=1)


def summed(field: FloatArray, influence: FloatArray) -> FloatArray:
    """The convolution cell by cell."""
    ny, nx = field.shape
    result = np.zeros_like(field)
    for y, x in np.ndindex(ny, nx):
        result += field[y, x] * influence[ny - 1 - y : 2 * ny - 1 - y, nx - 1 - x : 2 * nx - 1 - x]
    return result


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize(("given", "found"), [(1, 1), (2, 2), (2, 1), (1, 2)])
def test_a_padded_convolution_is_the_sum_over_cells(shape: tuple[int, int], given: int, found: int) -> None:
    rng = np.random.default_rng(0)
    convolution, fields = Convolution(shape, padded_lengths(shape)), rng.normal(size=(given, *shape))
    quadrants = rng.normal(size=(found, given, *shape))
    matrix = symbols([[convolution.spectrum(quadrant) for quadrant in row] for row in quadrants])
    expected = [
        sum(summed(field, even(quadrant, False, False)) for field, quadrant in zip(fields, row, strict=True))
        for row in quadrants
    ]
    np.testing.assert_allclose(convolution(fields, matrix), expected, rtol=0.0, atol=1e-12 * np.abs(expected).max())


@pytest.mark.parametrize(("odd_y", "odd_x", "turned"), [(True, True, False), (True, False, True), (False, True, True)])
def test_odd_influences_are_odd(odd_y: bool, odd_x: bool, turned: bool) -> None:
    shape, rng = (6, 9), np.random.default_rng(1)
    field, quadrant = rng.normal(size=shape), rng.normal(size=shape)
    quadrant[0] *= not odd_y
    quadrant[:, 0] *= not odd_x
    convolution = Convolution(shape, padded_lengths(shape))
    matrix = symbols([[convolution.spectrum(quadrant, odd_y, odd_x)]])
    expected = summed(field, even(quadrant, odd_y, odd_x))
    np.testing.assert_allclose(convolution(field[None], matrix, turned)[0], expected, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(convolution(field[None], matrix, turned, -1.0)[0], -expected, rtol=0.0, atol=1e-12)


def test_results_do_not_share_the_work_space() -> None:
    convolution = Convolution((4, 4), (8, 8))
    one = np.zeros((4, 4))
    one[0, 0] = 1.0
    matrix = symbols([[convolution.spectrum(one)]])
    first = convolution(np.ones((1, 4, 4)), matrix)
    convolution(np.zeros((1, 4, 4)), matrix)
    np.testing.assert_allclose(first, 1.0, rtol=1e-14)


def test_padded_lengths_leave_room_for_every_offset() -> None:
    for size in (1, 2, 17, 52, 100):
        assert padded_lengths((size, 3))[0] >= 2 * size - 1
