import time
from collections.abc import Callable
from threading import Thread

import numpy as np
import pytest

from slipcore.forces.inverse.covariance import (
    covariance_root,
    posterior,
    posterior_operator,
    solve_root,
    triangles_root,
)
from slipcore.forces.inverse.nearby_strength import TriangularResponse
from slipcore.forces.inverse.strength import Spectrum


@pytest.mark.parametrize(("m", "p"), [(1, 1), (5, 3), (40, 90), (90, 40), (3, 0)])
def test_the_root_is_that_of_noise_and_unknowns_and_is_solved_with_either_way(m: int, p: int) -> None:
    generator = np.random.default_rng(m)
    spread, data = generator.standard_normal((m, p)), generator.standard_normal((m, 2))
    before = spread.copy()
    root = covariance_root(spread)
    np.testing.assert_array_equal(spread, before)
    np.testing.assert_array_equal(root, np.triu(root))
    np.testing.assert_allclose(root.T @ root, np.eye(m) + spread @ spread.T, rtol=1e-13, atol=1e-12)
    for transposed, factor in ((False, root), (True, root.T)):  # condition 10 at most
        np.testing.assert_allclose(factor @ solve_root(root, data, transposed=transposed), data, rtol=1e-11, atol=1e-12)


@pytest.mark.parametrize("size", [1, 5, 90])
def test_the_root_of_a_triangle_is_that_of_its_square_and_the_unit_matrix(size: int) -> None:
    upper = np.triu(np.random.default_rng(size).standard_normal((size, size)))
    before = upper.copy()
    root = triangles_root(upper)
    np.testing.assert_array_equal(upper, before)
    np.testing.assert_array_equal(root, np.triu(root))
    np.testing.assert_allclose(root.T @ root, np.eye(size) + upper.T @ upper, rtol=1e-13, atol=1e-12)


def test_what_is_small_beside_the_largest_keeps_its_digits() -> None:
    root = covariance_root(np.array([[1e9, 0.0], [1e9, 1e-3]]))
    # of condition 1e9; the determinant of the sum itself, two of 1e36 apart, would be off by more than all of it
    assert np.prod(np.diag(root)) ** 2 == pytest.approx(2e18 + 1e12 + 1.0, rel=1e-6)


@pytest.mark.parametrize(("m", "p"), [(1, 1), (5, 3), (40, 90), (90, 40), (3, 0), (2, 2)])
def test_the_posterior_is_that_of_noise_and_unknowns_seen_or_not(m: int, p: int) -> None:
    response = np.random.default_rng(p).standard_normal((m, p))
    response[:, 1::3] = 0.0
    before = response.copy()
    root, operator = posterior(response)
    np.testing.assert_array_equal(response, before)
    np.testing.assert_array_equal(root, np.triu(root))
    covariance = np.linalg.inv(np.eye(p) + response.T @ response)  # of condition 300 at most
    np.testing.assert_allclose(root @ root.T, covariance, rtol=0.0, atol=1e-13)
    np.testing.assert_allclose(operator, covariance @ response.T, rtol=0.0, atol=1e-13)
    np.testing.assert_allclose(posterior_operator(response), operator, rtol=0.0, atol=1e-12)


def test_a_posterior_loses_the_digits_of_a_condition_number_and_not_of_its_square() -> None:
    """Its closed form is met along each direction, the best known one with a standard deviation of 1e-7: of that the
    normal equations would know no digit.
    """
    generator = np.random.default_rng(2)
    left, right = (np.linalg.qr(generator.standard_normal((60, 60)))[0] for _ in range(2))
    singular = np.logspace(7.0, -3.0, 60)
    root, operator = posterior(left * singular @ right.T)
    gain = singular / (1.0 + singular**2)
    np.testing.assert_allclose(np.linalg.norm(root.T @ right, axis=0), np.sqrt(gain / singular), rtol=1e-5)
    np.testing.assert_allclose(np.linalg.norm(operator @ left, axis=0), gain, rtol=1e-5)


@pytest.mark.parametrize(
    "do",
    [
        covariance_root,
        lambda matrix: Spectrum.of(matrix, matrix[0]),
        lambda matrix: TriangularResponse.of(matrix, matrix[0]).evidence(1.0),
    ],
)
def test_other_threads_go_on_meanwhile(do: Callable[[np.ndarray], object]) -> None:
    size, ticks = 300, 0
    while ticks < 10:  # where the interpreter is kept there are two at most, however much there is to do
        assert size < 3000
        thread, ticks = Thread(target=do, args=(np.random.default_rng(1).standard_normal((size, size)),)), 0
        thread.start()
        while thread.is_alive():
            time.sleep(1e-3)
            ticks += 1
        size *= 2
