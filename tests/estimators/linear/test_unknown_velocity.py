"""How far friction at unknown velocities may lie off, in its limits."""

import numpy as np
import pytest

from estimators.defaults import PRIOR, REFERENCE
from estimators.linear.unknown_velocity import columns_off, offset_variance

BEFORE = 0.1 * 0.5 / REFERENCE.tangential_velocity
"""Of a friction of 0.5 a tenth over the reference span."""


def test_a_slope_that_is_known_counts_as_it_is_and_one_that_is_not_as_before() -> None:
    assert offset_variance(0.5, 8.0, 0.0) == pytest.approx((1e-3 * 8.0) ** 2)
    assert offset_variance(0.5, 8.0, 1e12) == pytest.approx((1e-3 * BEFORE) ** 2, rel=1e-6)
    half = offset_variance(0.5, 8.0, BEFORE**2)
    assert half == pytest.approx(1e-6 * (4.0**2 + 0.5 * BEFORE**2))
    assert offset_variance(0.0, 8.0, 1.0) == 0.0


def test_friction_is_off_alike_and_tilted_about_the_mean_force() -> None:
    alike, tilted = columns_off(0.2)
    assert alike.tolist() == [1.0, 0.0, 0.0]
    at = np.array([[1.0, 3e-3, 0.2], [1.0, 0.0, 0.4], [1.0, 0.0, 0.0]])
    np.testing.assert_allclose(at @ tilted, [0.0, PRIOR.velocity_tilt, -PRIOR.velocity_tilt], atol=1e-15)
    assert columns_off(0.0)[1].tolist() == [0.0, 0.0, 0.0]
