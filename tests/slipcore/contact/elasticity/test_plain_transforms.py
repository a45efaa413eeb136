"""Transforms and convolutions as plain Python, against numpy's and the sum over cells."""

import numpy as np
import pytest

from slipcore.contact.elasticity import fourier, transform
from slipcore.contact.elasticity.transform import Convolution, padded_lengths, symbols
from slipcore.lanes import BYTES
from tests.slipcore.contact.elasticity.test_transform import even, summed
from tests.slipcore.plain_kernels import as_plain_python


@pytest.fixture(autouse=True)
def plain(monkeypatch: pytest.MonkeyPatch) -> None:
    as_plain_python(monkeypatch, fourier, transform)


@pytest.mark.parametrize("length", [2, 3, 4, 5, 8, 15, 36, 40])
def test_there_and_back(length: int) -> None:
    values = np.random.default_rng(length).normal(size=(length, 2, BYTES // 8))
    data, plan = values.reshape(-1).copy(), (fourier.radices(length), fourier.twiddles(length))
    fourier.forward(data, *plan)
    found = data.reshape(values.shape)[fourier.places(length)]
    expected = np.fft.fft(values[:, 0] + 1j * values[:, 1], axis=0)
    np.testing.assert_allclose(found[:, 0] + 1j * found[:, 1], expected, rtol=0.0, atol=1e-13 * length)
    fourier.inverse(data, *plan)
    np.testing.assert_allclose(data / length, values.reshape(-1), rtol=0.0, atol=1e-14 * length)


@pytest.mark.parametrize("shape", [(5, 8), (9, 11), (1, 17)])
@pytest.mark.parametrize(("given", "found"), [(1, 1), (2, 2), (2, 1), (1, 2)])
def test_a_convolution(shape: tuple[int, int], given: int, found: int) -> None:
    """Of a scale, and of fields that do not fill the lanes."""
    rng = np.random.default_rng(given + 2 * found)
    convolution, fields = Convolution(shape, padded_lengths(shape)), rng.normal(size=(given, *shape))
    quadrants = rng.normal(size=(found, given, *shape))
    matrix = symbols([[convolution.spectrum(quadrant) for quadrant in row] for row in quadrants])
    expected = np.array(
        [
            sum(summed(field, even(quadrant, False, False)) for field, quadrant in zip(fields, row, strict=True))
            for row in quadrants
        ]
    )
    np.testing.assert_allclose(convolution(fields, matrix, sign=-1.0), -expected, rtol=0.0, atol=1e-11)


def test_symbols_that_count_as_imaginary() -> None:
    shape, rng = (6, 9), np.random.default_rng(1)
    field, quadrant = rng.normal(size=shape), rng.normal(size=shape)
    quadrant[0] = 0.0
    convolution = Convolution(shape, padded_lengths(shape))
    matrix = symbols([[convolution.spectrum(quadrant, odd_y=True)]])
    expected = summed(field, even(quadrant, True, False))
    np.testing.assert_allclose(convolution(field[None], matrix, turned=True)[0], expected, rtol=0.0, atol=1e-12)
