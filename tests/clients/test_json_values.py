"""What a service or a file may say, and how another thing is named."""

import math

import numpy as np
import pytest

from stiction_client import json_values
from stiction_client.arguments import within
from stiction_client.errors import InvalidArgument


@pytest.mark.parametrize("value", [0, 0.25, np.float32(0.25), np.int64(3), -1e100, 1e100])
def test_a_number_is_any_real_one_of_a_size_that_fits_give(value: float) -> None:
    assert json_values.number("scale", value) == float(value)


@pytest.mark.parametrize(
    ("value", "told"),
    [
        (True, "scale, which is True, no number"),
        ("1", "scale, which is '1', no number"),
        (None, "scale, which is None, no number"),
        (math.nan, "scale, which is nan; allowed: finite, of a size up to 1e+100"),
        (-math.inf, "scale, which is -inf; allowed: finite, of a size up to 1e+100"),
        (10**400, "scale, which is 1000000000000000000000000000000000000000; allowed: finite"),
    ],
)
def test_what_is_no_such_number_is_named(value: object, told: str) -> None:
    with pytest.raises(ValueError) as refusal:  # noqa: PT011
        json_values.number("scale", value)
    assert str(refusal.value).startswith(told)


def test_the_least_number_is_allowed_and_what_it_has_to_be_above_is_not() -> None:
    assert json_values.number("n", 2, least=2.0) == 2.0
    assert json_values.number("n", 1e-300, above=0.0) == 1e-300
    with pytest.raises(ValueError, match=r"n, which is 1\.9; allowed: finite, 2 or more"):
        json_values.number("n", 1.9, least=2.0)
    with pytest.raises(ValueError, match="n, which is 0; allowed: finite, above 0"):
        json_values.number("n", 0, above=0.0)


def test_whole_numbers_texts_truths_and_members_are_what_they_are_called() -> None:
    assert (json_values.whole("n", 3.0, least=3), type(json_values.whole("n", 3.0, least=3))) == (3, int)
    assert (json_values.text("name", ""), json_values.truth("is", np.bool_(False))) == ("", False)
    assert json_values.members([("a", 1), ("b", 2)]) == {"a": 1, "b": 2}
    for wrong, told in (
        (lambda: json_values.whole("n", 2.5, least=0), "n, which is 2.5, no whole number"),
        (lambda: json_values.whole("n", 2, least=3), "n, which is 2; allowed: finite, 3 or more"),
        (lambda: json_values.text("name", 3), "name, which is 3, no text"),
        (lambda: json_values.truth("is", 1), "is, which is 1, neither true nor false"),
        (lambda: json_values.members([("a", 1), ("b", 2), ("b", 3)]), "b, which stands twice"),
    ):
        with pytest.raises(ValueError, match=told):
            wrong()


def test_degrees_of_freedom_are_above_0_and_null_is_infinitely_many() -> None:
    assert (json_values.degrees_of_freedom(None), json_values.degrees_of_freedom(0.5)) == (math.inf, 0.5)
    with pytest.raises(ValueError, match="degrees_of_freedom, which is 0; allowed: finite, above 0"):
        json_values.degrees_of_freedom(0.0)


def test_a_span_may_be_of_one_value_and_not_backwards_or_below_0() -> None:
    assert json_values.span("force", [0.0, 0.0]) == (0.0, 0.0)
    with pytest.raises(ValueError, match="force, from 2 to 1"):
        json_values.span("force", [2.0, 1.0])
    with pytest.raises(ValueError, match="force, which is -1; allowed: finite, 0 or more"):
        json_values.span("force", [-1.0, 1.0])


def test_a_covariance_may_lack_of_one_what_rounding_leaves() -> None:
    ones = np.ones((3, 3))
    for rest in (np.zeros((3, 3)), ones, ones - 0.9e-6 * np.diag([0.0, 0.0, 1.0]), np.diag([1.0, 0.0, 4.0])):
        np.testing.assert_array_equal(json_values.covariance(rest.tolist()), rest)
    skew = ones + np.array([[0.0, 0.9e-6, 0.0], [0.0] * 3, [0.0] * 3])
    json_values.covariance(skew.tolist())


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({(1, 1): -1.0}, "covariance, with the variance -1"),
        ({(0, 1): 1.1e-6}, "covariance, which is not symmetric"),
        ({(0, 1): 1.1, (1, 0): 1.1}, "covariance, by which some friction has a negative variance"),
        ({(2, 2): 0.0, (0, 2): 0.5, (2, 0): 0.5}, "covariance, which is not symmetric|negative variance"),
        ({(0, 1): math.nan}, "covariance, which is nan"),
    ],
)
def test_what_is_no_covariance_is_named(changes: dict[tuple[int, int], float], told: str) -> None:
    matrix = np.eye(3)
    for place, value in changes.items():
        matrix[place] = value
    with pytest.raises(ValueError, match=told):
        json_values.covariance(matrix.tolist())


@pytest.mark.parametrize("value", [1, 2.0, np.float32(1.5), np.array([1.0, 2.0]), [1, 2]])
def test_both_ends_of_a_range_are_within_it(value: object) -> None:
    found = within("load", value, 1.0, 2.0, "N")
    np.testing.assert_array_equal(found, value)  # type: ignore[arg-type]
    assert isinstance(found, float) == (np.ndim(value) == 0)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("value", "told"),
    [
        (0.99, "load is 0.99; allowed: 1 to 2 N"),
        (3, "load is 3; allowed: 1 to 2 N"),
        (math.nan, "load is nan; allowed: 1 to 2 N"),
        ([1.5, 2.5, 0.5], "load is 2.5; allowed: 1 to 2 N"),
        (True, "load is True; allowed: numbers: 1 to 2 N"),
        ("x" * 99, f"load is '{'x' * 59}; allowed: numbers: 1 to 2 N"),
        (2**53, f"load is {float(2**53)}; allowed: 1 to 2 N"),
    ],
)
def test_what_is_out_of_range_or_no_number_is_named(value: object, told: str) -> None:
    with pytest.raises(InvalidArgument) as refusal:
        within("load", value, 1.0, 2.0, "N")
    assert str(refusal.value) == told
