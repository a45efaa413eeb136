"""Transforms in kept work space."""

import numpy as np
import pytest

from slipcore.contact.elasticity.transform import Transform, multiply_pair, padded_lengths


@pytest.mark.parametrize("shape", [(5, 8), (8, 5), (1, 7), (16, 16)])
def test_forward_and_back_is_the_field(shape: tuple[int, int]) -> None:
    field = np.random.default_rng(0).normal(size=(2, *shape))
    for lengths in (shape, padded_lengths(shape)):
        transform = Transform(shape, lengths)
        spectrum = transform.forward(field)
        np.testing.assert_allclose(spectrum, np.fft.rfft2(field, lengths), rtol=0.0, atol=1e-12)
        np.testing.assert_allclose(transform.backward(spectrum), field, rtol=0.0, atol=1e-14)


def test_results_do_not_share_the_work_space() -> None:
    transform = Transform((4, 4), (8, 8))
    first = transform.backward(transform.forward(np.ones((1, 4, 4))))
    transform.backward(transform.forward(np.zeros((1, 4, 4))))
    np.testing.assert_allclose(first, 1.0)


def test_pairs_are_multiplied_by_the_matrix() -> None:
    rng = np.random.default_rng(1)
    spectrum = rng.normal(size=(2, 3, 4)) + 1j * rng.normal(size=(2, 3, 4))
    xx, yy, xy = rng.normal(size=(3, 3, 4))
    expected = np.stack((xx * spectrum[0] + xy * spectrum[1], xy * spectrum[0] + yy * spectrum[1]))
    plain = np.stack((xx * spectrum[0], yy * spectrum[1]))
    for cross, result in ((xy, expected), (None, plain)):
        work = spectrum.copy()
        multiply_pair(work, xx, yy, cross)
        np.testing.assert_allclose(work, result, rtol=1e-14)


def test_padded_lengths_leave_room_for_every_offset() -> None:
    for size in (1, 2, 17, 52, 100):
        assert padded_lengths((size, 3))[0] >= 2 * size - 1
