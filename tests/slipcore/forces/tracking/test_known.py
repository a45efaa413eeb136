"""Forces that are known beside displacement."""

import numpy as np
import pytest

from slipcore import InvalidInput
from slipcore.forces.tracking.known import KnownForce


@pytest.mark.parametrize("deviation", [0.0, -0.1, np.inf, np.nan])
def test_a_deviation_that_cannot_be_is_refused(deviation: float) -> None:
    with pytest.raises(InvalidInput, match="total_force_deviation"):
        KnownForce.of(np.ones(2), deviation, 2)


def test_a_deviation_of_no_force_is_refused() -> None:
    with pytest.raises(InvalidInput, match="beside total_force"):
        KnownForce.of(None, 0.1, 2)


def test_a_deviation_is_that_of_each_component_in_each_frame() -> None:
    known = KnownForce.of(np.array([1.0, 2.0]), 0.1, 2)
    np.testing.assert_array_equal(known.force[:, 2], [1.0, 2.0])
    assert np.isnan(known.force[:, :2]).all()
    np.testing.assert_array_equal(known.deviation, np.full((2, 3), 0.1))
