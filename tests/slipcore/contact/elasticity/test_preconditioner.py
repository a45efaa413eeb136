"""The circulants that stand for operators while an iteration goes on."""

import numpy as np
import pytest

from slipcore.contact.elasticity.preconditioner import circulant_spectrum


@pytest.mark.parametrize(("odd", "part"), [(False, np.cos), (True, np.sin)])
def test_a_circulant_is_its_own_nearest_one(odd: bool, part: np.ufunc) -> None:
    """cos(by) cos(ax) has one pair of waves along x, and sin(by) sin(ax) the same with one sign for each direction."""
    angle = 2.0 * np.pi * np.arange(8) / 8
    quadrant = np.outer(part(3.0 * angle), part(2.0 * angle))
    expected = np.zeros((5, 8))
    expected[3, [2, 6]] = [-16.0, 16.0] if odd else [16.0, 16.0]
    np.testing.assert_allclose(circulant_spectrum(quadrant, odd), expected, rtol=0.0, atol=1e-13, err_msg="rounding")
