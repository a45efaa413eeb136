"""What is no number, no array or of another kind is named, with what is allowed."""

import math
from datetime import date
from types import NoneType

import numpy as np
import pytest

from slipcore.arguments import array_of, number, of_kind, real_array, whole
from slipcore.errors import InvalidInput


@pytest.mark.parametrize("value", [2, 2.0, np.float32(2.0), np.int64(2), np.array(2.0)])
def test_any_kind_of_number_is_one(value: object) -> None:
    found = number("depth", value)
    assert type(found) is float
    assert found == 2.0


@pytest.mark.parametrize(
    "value", ["2", None, True, np.True_, [2.0], (2.0,), {}, 2j, 10**400, np.ma.masked, date.today()]
)
def test_what_is_no_number_is_named(value: object) -> None:
    with pytest.raises(InvalidInput, match=r"^depth is .*; allowed: 0 m or more$"):
        number("depth", value, "0 m or more")


def test_infinite_and_missing_ones_are_left_to_the_range() -> None:
    assert number("depth", math.inf) == math.inf
    assert math.isnan(number("depth", math.nan))


@pytest.mark.parametrize("value", [-1, 3, 1.0, True, "1", None])
def test_what_is_no_whole_number_in_range_is_named(value: object) -> None:
    with pytest.raises(InvalidInput, match=r"^row is .*; allowed: a whole number, 0 to 2$"):
        whole("row", value, 0, 2)
    assert whole("row", np.int32(2), 0, 2) == 2


@pytest.mark.parametrize(
    "value", ["a", ["a"], None, [True], [[1.0], [1.0, 2.0]], 1j, np.ma.masked_less([1.0, 2.0], 1.5)]
)
def test_what_is_no_array_of_numbers_is_named(value: object) -> None:
    with pytest.raises(InvalidInput, match=r"^force is .*; allowed: an array of real numbers$"):
        real_array("force", value)


def test_rows_of_different_lengths_are_no_array() -> None:
    with pytest.raises(InvalidInput, match=r"^observed is not an array .*; allowed: bool of shape"):
        array_of("observed", [[True], [True, False]], "bool of shape [2, 2]")


def test_another_kind_is_named_with_the_kinds_that_are_allowed() -> None:
    of_kind("log", None, int | NoneType)
    with pytest.raises(InvalidInput, match=r"^log is 'text'; allowed: int or None$"):
        of_kind("log", "text", int | NoneType)
