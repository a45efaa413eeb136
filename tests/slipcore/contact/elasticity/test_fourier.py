"""Transforms of several sequences at a time."""

import numpy as np
import pytest

from slipcore.contact.elasticity.fourier import forward, inverse, places, radices, twiddles
from slipcore.lanes import BYTES


@pytest.mark.parametrize(("precision", "rounding"), [(np.float64, 1e-14), (np.float32, 1e-5)])
@pytest.mark.parametrize("length", [1, 2, 3, 4, 5, 6, 12, 20, 48, 75, 128, 216, 250])
def test_transforms_are_those_of_numpy_in_another_order(length: int, precision: type, rounding: float) -> None:
    rng = np.random.default_rng(length)
    values = rng.normal(size=(length, 2, BYTES // np.dtype(precision).itemsize)).astype(precision)
    data = values.reshape(-1).copy()
    forward(data, radices(length), twiddles(length))
    found = data.reshape(values.shape)[places(length)]
    expected = np.fft.fft(values[:, 0] + 1j * values[:, 1], axis=0)
    np.testing.assert_allclose(found[:, 0] + 1j * found[:, 1], expected, rtol=0.0, atol=rounding * length)
    inverse(data, radices(length), twiddles(length))
    np.testing.assert_allclose(data / length, values.reshape(-1), rtol=0.0, atol=rounding)


def test_a_length_with_another_factor_is_refused() -> None:
    with pytest.raises(AssertionError):
        radices(14)
