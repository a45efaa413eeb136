"""The same formulas of one float and of arrays."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy.stats import t as student_t

from stiction_client import elementwise as each

PAIRS = [(1.0, 2.0), (2.0, 1.0), (1.5, 1.5), (-3.0, 4.0), (0.0, -1.0)]


@pytest.mark.parametrize(("one", "plain"), [(each.least, min), (each.greatest, max), (each.hypot, math.hypot)])
def test_two_numbers_and_two_arrays_give_the_same(one: Callable[..., Any], plain: Callable[..., float]) -> None:
    expected = [plain(a, b) for a, b in PAIRS]
    assert [one(a, b) for a, b in PAIRS] == expected
    left, right = np.array(PAIRS).T
    assert one(left, right).tolist() == pytest.approx(expected, rel=1e-15)
    assert one(left, 1.0).tolist() == pytest.approx([plain(a, 1.0) for a, _ in PAIRS], rel=1e-15)
    assert one(1.0, right).tolist() == pytest.approx([plain(1.0, b) for _, b in PAIRS], rel=1e-15)


def test_a_choice_is_made_in_each_place() -> None:
    assert each.select(condition=True, yes=1.0, no=2.0) == 1.0
    assert each.select(condition=np.bool_(False), yes=1.0, no=2.0) == 2.0
    chosen = each.select(np.array([True, False]), np.array([1.0, 2.0]), 3.0)
    assert np.asarray(chosen).tolist() == [1.0, 3.0]


def test_a_root_of_what_rounding_made_negative_is_0() -> None:
    assert [each.root(value) for value in (4.0, 0.0, -1e-30)] == [2.0, 0.0, 0.0]
    assert np.asarray(each.root(np.array([4.0, -1.0]))).tolist() == [2.0, 0.0]


def test_logarithms_are_natural() -> None:
    assert each.logarithm(math.e) == pytest.approx(1.0)
    assert np.asarray(each.logarithm(np.array([1.0, math.e]))).tolist() == pytest.approx([0.0, 1.0])


def test_something_holds_anywhere() -> None:
    assert each.anywhere(condition=True)
    assert not each.anywhere(condition=False)
    assert each.anywhere(np.array([False, True]))
    assert not each.anywhere(np.array([False, False]))


def test_students_quantile_is_a_float_of_one_level_and_an_array_of_many() -> None:
    for degrees in (3.0, 12.5, math.inf):
        one = each.student_quantile(degrees, 0.01)
        assert type(one) is type(each.student_quantile(degrees, np.float64(0.01))) is float
        assert one == pytest.approx(student_t.ppf(0.01, degrees), rel=1e-12)
        many = np.asarray(each.student_quantile(degrees, np.array([[0.01], [0.3]])))
        assert many == pytest.approx(student_t.ppf([[0.01], [0.3]], degrees), rel=1e-12)
    assert each.student_quantile(3.0, 0.02) != each.student_quantile(4.0, 0.02)
