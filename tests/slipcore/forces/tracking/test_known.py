"""Forces that are known beside displacement."""

import numpy as np
import pytest

from slipcore import InvalidInput
from slipcore.forces.operator.gel import Gel
from slipcore.forces.tracking.known import KnownForce, contradicts


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


def test_forces_along_three_axes_are_turned_into_the_gel_and_one_is_taken_as_it_presses() -> None:
    known = KnownForce.of(np.array([[1.0, 2.0, -3.0]]), 0.1, 1)
    assert known.force.tolist() == [[1.0, 2.0, 3.0]]
    assert KnownForce.of(np.array([3.0]), 0.1, 1).force[0, 2] == 3.0


def test_without_a_deviation_a_force_is_known_to_a_hundredth_of_itself_or_of_the_largest() -> None:
    """0.01 of 50 N, but of 0.1 N 0.01 of a hundredth of the largest; that may have been before."""
    known = KnownForce.of(np.array([50.0, 0.1, np.nan]), None, 3)
    np.testing.assert_allclose(known.deviation[:2, 2], [0.5, 0.005])
    assert known.given[:, 2].tolist() == [True, True, False]
    assert np.isinf(known.noise[2, 2])
    np.testing.assert_allclose(KnownForce.of(np.array([0.1]), None, 1, largest=200.0).deviation[0, 2], 0.02)
    np.testing.assert_allclose(KnownForce.of(np.zeros(1), None, 1).deviation[0, 2], 1e-13)


@pytest.mark.parametrize("force", [np.ones(3), np.ones((2, 2)), np.array([1.0, np.inf])])
def test_forces_of_other_shapes_or_without_end_are_refused(force: np.ndarray) -> None:
    with pytest.raises(InvalidInput, match=r"finite, \[2\] or \[2, 3\] N"):
        KnownForce.of(force, None, 2)


def test_known_and_found_part_by_the_deviation_of_both() -> None:
    """Along z the known one points into the gel: 3 against −4 outwards are 1 apart, to 0.5."""
    known = KnownForce(np.array([np.nan, 1.0, 3.0]), np.array([1.0, 0.3, 0.3]))
    away = known.away(np.array([9.0, 1.0, -4.0]), np.full(3, 0.4))
    assert away[1:].tolist() == [0.0, pytest.approx(2.0)]
    assert np.isnan(away[0])
    for at, expected in ((2.99, False), (3.01, True)):
        assert contradicts(np.array([[np.nan, 0.0, at]])).tolist() == [expected]


def test_a_force_beyond_what_the_gel_bears_is_refused_with_the_bound() -> None:
    """Ten times 1 MPa on 2 mm²."""
    gel = Gel(1e6, 0.45, np.inf, 0.0)
    KnownForce.of(np.array([19.9]), None, 1).check("grip", gel, 2e-6)
    with pytest.raises(InvalidInput, match=r"grip is up to 20\.1 N; allowed: at most 20 N"):
        KnownForce.of(np.array([-20.1]), None, 1).check("grip", gel, 2e-6)
