"""The range check of closed forms: which values pass, and what is said of others."""

import math
import re
from typing import Any

import numpy as np
import pytest

from slipcore.contact.reference.checks import check_range
from slipcore.errors import InvalidInput


@pytest.mark.parametrize(
    ("value", "bounds"),
    [
        (1e-300, {"above": 0.0}),
        (0.0, {"at_least": 0.0}),
        (-3.0, {}),
        (2.0, {"at_most": 2.0}),
        (0.5, {"above": 0.0, "at_most": 0.5}),
        (0.0, {"at_least": 0.0, "at_most": 0.5}),
    ],
)
def test_a_value_within_its_bounds_is_given_back(value: float, bounds: dict[str, float]) -> None:
    assert check_range("load", value, **bounds) is value


@pytest.mark.parametrize(
    ("value", "bounds", "unit", "told"),
    [
        (0.0, {"above": 0.0}, "Pa", "load is 0 Pa; allowed: above 0 Pa"),
        (-1e-9, {"at_least": 0.0}, "N", "load is -1e-09 N; allowed: at least 0 N"),
        (0.5000001, {"above": 0.0, "at_most": 0.5}, "", "load is 0.5000001; allowed: above 0 and at most 0.5"),
        (-1.0, {"at_least": 0.0, "at_most": 2.0}, "m", "load is -1 m; allowed: at least 0 and at most 2 m"),
        (math.inf, {"above": 0.0}, "m", "load is inf m; allowed: above 0 m"),
        (math.nan, {"at_most": 1.0}, "m", "load is nan m; allowed: at most 1 m"),
        (-math.inf, {"at_most": 1.0}, "", "load is -inf; allowed: at most 1"),
        (np.float32(-2.0), {"above": 0.0}, "N", "load is -2 N; allowed: above 0 N"),
        (None, {"above": 0.0}, "N", "load is None; allowed: above 0 N"),
        ("1", {"above": 0.0}, "N", "load is '1'; allowed: above 0 N"),
        (True, {"above": 0.0}, "N", "load is True; allowed: above 0 N"),
        (np.ones(2), {}, "N", "load is array([1., 1.]); allowed: a finite number of N"),
    ],
)
def test_a_value_beyond_them_is_refused_with_its_unit(
    value: Any, bounds: dict[str, float], unit: str, told: str
) -> None:
    with pytest.raises(InvalidInput, match=re.escape(told) + "$"):
        check_range("load", value, unit=unit, **bounds)


@pytest.mark.parametrize("value", [math.inf, -math.inf, math.nan])
def test_a_value_without_bounds_is_finite(value: float) -> None:
    with pytest.raises(InvalidInput, match="load is"):
        check_range("load", value)
