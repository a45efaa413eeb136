import numpy as np
import pytest

from slipcore.defaults import ContactOptions
from slipcore.touch import contact_from_force, contact_from_shape

OPTIONS = ContactOptions()
AREA = 1e-6


def test_the_threshold_is_the_largest_of_pressure_share_and_noise() -> None:
    pressing = np.array([[1e-1, 6e-3, 4e-3, -1e-1]])
    np.testing.assert_array_equal(contact_from_force(pressing, AREA, np.nan, None, OPTIONS), [[1, 1, 0, 0]])
    np.testing.assert_array_equal(contact_from_force(pressing, AREA, 2e-3, None, OPTIONS), [[1, 0, 0, 0]])
    weak = np.array([[6e-4, 4e-4]])  # 500 Pa on 1 mm² is 0.5 mN
    np.testing.assert_array_equal(contact_from_force(weak, AREA, 0.0, None, OPTIONS), [[1, 0]])


def test_an_element_is_released_later_than_it_would_touch() -> None:
    pressing, before = np.array([[4.5e-4, 4.5e-4, 3e-4]]), np.array([[True, False, True]])
    np.testing.assert_array_equal(contact_from_force(pressing, AREA, np.nan, before, OPTIONS), [[1, 0, 0]])


@pytest.mark.parametrize("depth", [2e-4, 1e-3])
def test_the_shape_tells_contact_by_a_share_of_its_depth(depth: float) -> None:
    indentation = depth * np.array([[1.0, 0.4, 0.2, -0.5]])
    np.testing.assert_array_equal(contact_from_shape(indentation, np.nan, None, OPTIONS), [[1, 1, 0, 0]])


def test_a_sensor_at_rest_touches_nothing() -> None:
    assert not contact_from_shape(np.array([[2e-5, 0.0]]), 1e-6, None, OPTIONS).any()
