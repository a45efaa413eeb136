"""Singular values and components of data against numpy's decomposition."""

import numpy as np
import pytest

from slipcore.forces.inverse.singular_values import singular_components


@pytest.mark.parametrize(("m", "p"), [(1, 1), (1, 7), (7, 1), (40, 90), (90, 40), (64, 64), (300, 129)])
def test_they_are_those_of_the_decomposition(m: int, p: int) -> None:
    generator = np.random.default_rng(m)
    matrix = generator.standard_normal((m, p)) * 10.0 ** generator.uniform(-5.0, 0.0, p)
    data = generator.standard_normal(m)
    before = matrix.copy(), data.copy()
    s, y = singular_components(matrix, data)
    u, expected, _ = np.linalg.svd(matrix, full_matrices=False)
    np.testing.assert_allclose(s, expected, rtol=1e-9)
    np.testing.assert_allclose(np.abs(y), np.abs(data @ u), rtol=1e-6, atol=1e-8)
    np.testing.assert_array_equal(matrix, before[0])
    np.testing.assert_array_equal(data, before[1])


def test_directions_that_nothing_reaches_have_no_singular_value() -> None:
    s, y = singular_components(np.zeros((3, 2)), np.array([1.0, -2.0, 3.0]))
    np.testing.assert_array_equal(s, 0.0)
    assert y.shape == (2,)
