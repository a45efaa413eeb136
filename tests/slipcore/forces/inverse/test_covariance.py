import time
from collections.abc import Callable
from threading import Thread

import numpy as np
import pytest

from slipcore.forces.inverse.covariance import covariance_root, solve_root
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


def test_what_is_small_beside_the_largest_keeps_its_digits() -> None:
    root = covariance_root(np.array([[1e9, 0.0], [1e9, 1e-3]]))
    # of condition 1e9; the determinant of the sum itself, two of 1e36 apart, would be off by more than all of it
    assert np.prod(np.diag(root)) ** 2 == pytest.approx(2e18 + 1e12 + 1.0, rel=1e-6)


@pytest.mark.parametrize("do", [covariance_root, lambda matrix: Spectrum.of(matrix, matrix[0])])
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
