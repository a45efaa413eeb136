"""What is assumed of traction before any marker is seen."""

import numpy as np
import pytest

from slipcore.forces.inverse.prior import factors, usual
from slipcore.frames import FloatArray

PITCH = 1e-3
PLACES = PITCH * np.stack(np.meshgrid(np.arange(5.0), np.arange(4.0)), axis=-1).reshape(-1, 2)
RIM = PITCH * np.array([[-1.0, 0.0], [-1.0, 1.0], [5.0, 2.0], [2.0, 4.0]])


def correlation(one: FloatArray, other: FloatArray, length: float) -> FloatArray:
    """Matérn 3/2."""
    reach = np.sqrt(3.0) * np.hypot(*(one[:, None] - other).transpose(2, 0, 1)) / length
    return np.asarray((1.0 + reach) * np.exp(-reach))


def test_pressure_that_falls_is_the_same_field_given_that_it_is_zero_at_the_rim() -> None:
    length = PITCH * usual().pressure
    inside, across = correlation(PLACES, PLACES, length), correlation(PLACES, RIM, length)
    known = inside - across @ np.linalg.solve(correlation(RIM, RIM, length), across.T)
    root = factors(PLACES, PITCH, usual(), RIM)[2]
    np.testing.assert_allclose(root @ root.T, known / np.diag(known).mean(), rtol=0.0, atol=1e-5)
    beside_it, between = np.sum(root[[0, 7]] ** 2, axis=1)
    assert beside_it < 0.5 * between


def test_shear_does_not_know_of_the_rim_and_pressure_is_as_strong_with_it() -> None:
    free, falling = factors(PLACES, PITCH, usual()), factors(PLACES, PITCH, usual(), RIM)
    np.testing.assert_array_equal(falling[:2], free[:2])
    assert np.linalg.norm(falling[2]) == pytest.approx(np.linalg.norm(free[2]))
