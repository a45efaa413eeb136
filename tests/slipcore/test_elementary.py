"""Exponentials and logarithms of many numbers against the C library's."""

from inspect import unwrap

import numpy as np
import pytest
from scipy.special import log_ndtr

from slipcore.elementary import exponentials, logarithms, logarithms_of_normal_cdf, probabilities_of_hazards

EXPONENTS = np.concatenate([np.linspace(-708.0, 709.0, 200_003), np.linspace(-1.0, 1.0, 20_001), [0.0, 1e-300, -1e-17]])
HAZARDS = np.concatenate([np.geomspace(1e-300, 700.0, 200_003), np.linspace(0.0, 2.0, 20_001)])
NUMBERS = np.concatenate([np.geomspace(3e-308, 1e308, 200_003), np.linspace(0.5, 2.0, 20_002), [1.0]])


def of(function: object, values: np.ndarray) -> np.ndarray:
    found = values.copy()
    function(found)  # type: ignore[operator]
    return found


def test_exponentials_are_those_of_the_c_library_to_two_units() -> None:
    np.testing.assert_allclose(of(exponentials, EXPONENTS), np.exp(EXPONENTS), rtol=4.5e-16, atol=0.0)
    assert of(exponentials, np.zeros(1)) == 1.0


def test_beyond_normal_numbers_an_exponential_stays_at_the_bound() -> None:
    np.testing.assert_allclose(of(exponentials, np.array([-1e9, -np.inf])), np.exp(-708.0), rtol=4.5e-16)
    np.testing.assert_allclose(of(exponentials, np.array([1e9, np.inf])), np.exp(709.0), rtol=4.5e-16)


def test_small_hazards_keep_their_digits() -> None:
    np.testing.assert_allclose(of(probabilities_of_hazards, HAZARDS), -np.expm1(-HAZARDS), rtol=4.5e-16, atol=0.0)
    assert of(probabilities_of_hazards, np.array([0.0, np.inf])).tolist() == [0.0, 1.0]


def test_logarithms_are_those_of_the_c_library_to_two_units() -> None:
    np.testing.assert_allclose(of(logarithms, NUMBERS), np.log(NUMBERS), rtol=4.5e-16, atol=0.0)
    assert of(logarithms, np.ones(1)) == 0.0


def test_logarithms_of_the_normal_distribution_are_those_of_scipy() -> None:
    z = np.concatenate([np.linspace(0.0, 10.0, 200_003), np.geomspace(10.0, 1e40, 1001)])
    np.testing.assert_allclose(of(logarithms_of_normal_cdf, z), log_ndtr(z), rtol=0.0, atol=5e-16)


@pytest.mark.parametrize("function", [exponentials, probabilities_of_hazards, logarithms, logarithms_of_normal_cdf])
def test_a_number_is_the_same_wherever_it_stands(function: object) -> None:
    """In the vectors of a long loop and in what is left over at its end."""
    values = np.linspace(0.1, 3.0, 37)
    one_by_one = [of(function, values[k : k + 1])[0] for k in range(len(values))]
    assert of(function, values).tolist() == one_by_one
    assert of(unwrap(function), values).tolist() == one_by_one  # type: ignore[arg-type]
