"""Eight numbers at a time."""

import numpy as np
import pytest
from numba.core.errors import TypingError

from slipcore.compilation import compiled
from slipcore.frames import FloatArray
from slipcore.lanes import load, store, transpose


@compiled
def _combined(a: FloatArray, at: int, factor: float, result: FloatArray) -> None:
    store(result, 1, (load(a, at) + load(a, at + 8)) * factor - load(a, at) * load(a, at + 8))


@compiled
def _exchanged(a: FloatArray, at: int) -> None:
    transpose(a, at)


def test_sums_and_products_are_of_each_of_the_eight() -> None:
    a, result = np.random.default_rng(0).normal(size=20), np.zeros(10)
    _combined(a, 3, 2.5, result)
    np.testing.assert_allclose(result[1:9], (a[3:11] + a[11:19]) * 2.5 - a[3:11] * a[11:19], rtol=1e-14)
    assert result[0] == result[9] == 0.0


def test_rows_and_columns_of_a_square_change_places() -> None:
    a = np.arange(70.0)
    expected = a.copy()
    expected[2:66] = a[2:66].reshape(8, 8).T.ravel()
    _exchanged(a, 2)
    np.testing.assert_array_equal(a, expected)


def test_single_precision_has_its_own_lanes() -> None:
    a, result = np.random.default_rng(0).normal(size=20).astype(np.float32), np.zeros(10, dtype=np.float32)
    _combined(a, 3, 2.5, result)
    np.testing.assert_allclose(result[1:9], (a[3:11] + a[11:19]) * 2.5 - a[3:11] * a[11:19], rtol=1e-5, atol=1e-6)
    assert result[0] == result[9] == 0.0
    square = np.arange(70.0, dtype=np.float32)
    expected = square.copy()
    expected[2:66] = square[2:66].reshape(8, 8).T.ravel()
    _exchanged(square, 2)
    np.testing.assert_array_equal(square, expected)


@pytest.mark.parametrize("a", [np.zeros(64, dtype=np.int64), np.zeros(128)[::2], np.zeros((8, 8))])
def test_other_arrays_than_flat_ones_of_real_numbers_are_refused(a: np.ndarray) -> None:
    with pytest.raises(TypingError, match="contiguous array"):
        _exchanged(a, 0)
