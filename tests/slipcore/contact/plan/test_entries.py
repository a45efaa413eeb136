"""What the entries of a scene may be."""

import math

import numpy as np
import pytest

from slipcore.contact.effects import FrictionPatch, MeasuredSurface, RandomFriction, TangentialLoad, WavySurface
from slipcore.contact.plan.entries import check_finite, check_types
from slipcore.errors import InvalidInput


@pytest.mark.parametrize("value", [(1, 2.0), [1.0, 2.0], np.array([1.0, 2.0]), (np.float32(1.0), np.int64(2))])
def test_rows_of_numbers_may_be_tuples_lists_or_arrays(value: object) -> None:
    check_types(TangentialLoad, {"force": value})


@pytest.mark.parametrize("value", [2.0, "20", (1.0, 2.0, 3.0), ("1", 2.0), (True, 1.0), {"x": 1.0}, None])
def test_what_is_no_row_of_as_many_numbers_is_refused(value: object) -> None:
    with pytest.raises(InvalidInput, match="force of TangentialLoad"):
        check_types(TangentialLoad, {"force": value})


@pytest.mark.parametrize("heights", [(1.0, 2.0), ((0.0, 1.0), (0.0,)), (("a", "b"), ("c", "d"))])
def test_a_map_is_rows_of_numbers(heights: object) -> None:
    check_types(MeasuredSurface, {"heights": np.zeros((3, 4))})
    with pytest.raises(InvalidInput, match="heights of MeasuredSurface"):
        check_types(MeasuredSurface, {"heights": heights})


def test_a_ragged_map_is_told_its_first_row_of_another_length() -> None:
    with pytest.raises(InvalidInput, match="heights of MeasuredSurface is 3 long in row 1 and 2 in row 0"):
        MeasuredSurface(((0.0, 1.0), (0.0, 1.0, 2.0), (0.0,)), 1e-3)
    with pytest.raises(InvalidInput, match="1 long in row 1"):
        check_types(MeasuredSurface, {"heights": [[0.0, 1.0], 3.0]})


@pytest.mark.parametrize("wrong", [math.nan, math.inf])
def test_numbers_of_effects_are_finite(wrong: float) -> None:
    with pytest.raises(InvalidInput, match="change of FrictionPatch"):
        check_finite(FrictionPatch(wrong, (0.0, 0.0), 1e-3))
    with pytest.raises(InvalidInput, match="amplitude of WavySurface"):
        check_finite(WavySurface(wrong, 1e-3))


def test_lengths_of_what_is_not_there_may_be_infinite_but_not_nan() -> None:
    check_finite(RandomFriction(0.1, math.inf))
    check_finite(FrictionPatch(0.1, (0.0, 0.0), math.inf))
