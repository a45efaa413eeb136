"""64 bytes of numbers at a time."""

import numpy as np
import pytest
from numba.core.errors import TypingError

from slipcore.compilation import compiled
from slipcore.frames import FloatArray
from slipcore.lanes import count, load, store, transpose


@compiled
def _combined(a: FloatArray, at: int, factor: float, result: FloatArray) -> None:
    other = at + count(a)
    store(result, 1, (load(a, at) + load(a, other)) * factor - load(a, at) * load(a, other))


@compiled
def _exchanged(a: FloatArray, at: int) -> None:
    transpose(a, at)


@pytest.mark.parametrize(("precision", "rounding"), [(np.float64, 1e-14), (np.float32, 1e-5)])
def test_sums_and_products_are_of_each_of_the_numbers(precision: type, rounding: float) -> None:
    number = 64 // np.dtype(precision).itemsize
    a, result = np.random.default_rng(0).normal(size=40).astype(precision), np.zeros(20, dtype=precision)
    _combined(a, 3, 2.5, result)
    one, other = a[3 : 3 + number], a[3 + number : 3 + 2 * number]
    np.testing.assert_allclose(result[1 : number + 1], (one + other) * 2.5 - one * other, rtol=rounding, atol=rounding)
    assert result[0] == 0.0
    assert not result[number + 1 :].any()


@pytest.mark.parametrize("precision", [np.float64, np.float32])
def test_rows_and_columns_of_a_square_change_places(precision: type) -> None:
    number = 64 // np.dtype(precision).itemsize
    a = np.arange(number**2 + 6.0).astype(precision)
    expected = a.copy()
    expected[2:-4] = a[2:-4].reshape(number, number).T.ravel()
    _exchanged(a, 2)
    np.testing.assert_array_equal(a, expected)


@pytest.mark.parametrize("a", [np.zeros(64, dtype=np.int64), np.zeros(128)[::2], np.zeros((8, 8))])
def test_other_arrays_than_flat_ones_of_real_numbers_are_refused(a: np.ndarray) -> None:
    with pytest.raises(TypingError, match="contiguous array"):
        _exchanged(a, 0)
