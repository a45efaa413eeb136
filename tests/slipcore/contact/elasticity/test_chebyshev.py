"""Chebyshev polynomials at many points against numpy's."""

import numpy as np
import pytest
from numpy.polynomial import Chebyshev

from slipcore.contact.elasticity.chebyshev import evaluate


@pytest.mark.parametrize("terms", [1, 2, 3, 27])
@pytest.mark.parametrize("shape", [(7,), (5, 3), (4, 3, 9)])
def test_values_are_those_of_numpy_to_the_last_bit(terms: int, shape: tuple[int, ...]) -> None:
    draw = np.random.default_rng(terms)
    polynomial = Chebyshev(draw.standard_normal(terms), domain=[0.0, 5.5])
    for x in (draw.uniform(0.0, 5.5, shape), draw.uniform(0.0, 5.5, shape[::-1]).T):
        np.testing.assert_array_equal(evaluate(polynomial, x), polynomial(x))
