"""What callers may pass: a number, or many, within their range."""

import json
from typing import Any

import numpy as np
import pytest

from stiction_client import InvalidArgument
from stiction_client.arguments import for_json, number, of_kind, of_one_shape, within


@pytest.mark.parametrize("value", [1, 1.0, np.float64(1.0), np.int32(1), np.array(1.0), np.float32(1.0)])
def test_one_number_comes_back_as_a_float(value: Any) -> None:
    found = within("load", value, 0.0, 2.0)
    assert (type(found), found) == (float, 1.0)


def test_many_come_back_in_their_shape() -> None:
    found = within("load", [[0, 1], [2, 1]], 0.0, 2.0)
    assert isinstance(found, np.ndarray)
    assert found.dtype == np.float64
    assert found.tolist() == [[0.0, 1.0], [2.0, 1.0]]
    assert np.shape(within("load", [], 0.0, 2.0)) == (0,)


@pytest.mark.parametrize("value", [0.0, 2.0, [0.0, 2.0]])
def test_the_ends_of_the_range_are_in_it(value: Any) -> None:
    assert np.array_equal(within("load", value, 0.0, 2.0), value)


@pytest.mark.parametrize(
    ("value", "shown"),
    [
        (-1e-9, "-1e-09"),
        (2.5, "2.5"),
        (3, "3"),
        (np.nan, "nan"),
        (np.inf, "inf"),
        ([1.0, 2.5, -1.0], "2.5"),
        (np.array(-1), "-1.0"),
        (2**60, "1.152921504606847e.18"),
    ],
)
def test_what_is_beyond_is_told_with_the_range_and_its_unit(value: Any, shown: str) -> None:
    with pytest.raises(InvalidArgument, match=rf"^load is {shown}; allowed: 0 to 2 N$"):
        within("load", value, 0.0, 2.0, "N")
    with pytest.raises(InvalidArgument, match=r"allowed: 0 to 2$"):
        within("load", value, 0.0, 2.0)


@pytest.mark.parametrize(
    "value", ["1", None, True, [True], [1, True], [[1.0], (False,)], 1j, [1.0, "2"], [None], "x" * 100]
)
def test_what_is_no_number_is_told_as_such(value: Any) -> None:
    with pytest.raises(InvalidArgument) as refusal:
        within("load", value, 0.0, 2.0, "N")
    assert refusal.value.allowed == "numbers: 0 to 2 N"
    assert refusal.value.value == repr(value)[:60]


@pytest.mark.parametrize(("value", "is_exact"), [(2**53 - 1, True), (2**53 + 1, False)])
def test_whole_numbers_beyond_those_of_a_float_are_rounded(value: int, is_exact: bool) -> None:
    found = within("count", value, 0.0, 1e300)
    assert (int(found) == value) is is_exact


def test_numbers_and_arrays_of_numpy_are_sent_as_plain_ones() -> None:
    body = {"seed": np.int64(3), "load": np.float32(2.0), "rows": np.ones((1, 2)), "pair": (np.bool_(True), None)}
    assert json.dumps(for_json("body", body)) == '{"seed": 3, "load": 2.0, "rows": [[1.0, 1.0]], "pair": [true, null]}'


@pytest.mark.parametrize("value", [np.nan, [1.0, np.inf], np.array([[1.0, -np.inf]]), {1, 2}, b"a", object(), 1j])
def test_what_json_does_not_have_is_refused_by_name(value: Any) -> None:
    with pytest.raises(InvalidArgument, match=r"^thickness is .*; allowed: (a finite number|numbers, text)"):
        for_json("body", {"gel": {"thickness": value}})


def test_a_masked_entry_is_no_number() -> None:
    with pytest.raises(InvalidArgument, match=r"^load is masked_array"):
        within("load", np.ma.masked_array([1.0, 2.0], [False, True]), 0.0, 2.0)


def test_one_number_is_asked_for_where_arrays_are_no_answer() -> None:
    assert number("area", np.float32(0.5), 0.0, 1.0) == 0.5
    with pytest.raises(InvalidArgument, match=r"^area is \[0\.5, 0\.5\]; allowed: one number: 0 to 1 m$"):
        number("area", [0.5, 0.5], 0.0, 1.0, "m")


def test_arrays_that_do_not_belong_together_are_named_with_their_shapes() -> None:
    of_one_shape(load=np.ones(3), area=1.0, torque=np.ones((2, 1)), limit=None)
    with pytest.raises(InvalidArgument, match=r"^load and area is \[3\] and \[2\]; allowed: one length"):
        of_one_shape(load=np.ones(3), area=np.ones(2), torque=1.0)


def test_of_which_kinds_a_value_may_be_is_told() -> None:
    of_kind("pair", (1, 2), tuple | list)
    with pytest.raises(InvalidArgument, match=r"^pair is 3; allowed: an object of tuple or list$"):
        of_kind("pair", 3, tuple | list)
