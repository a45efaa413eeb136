"""Floats and arrays in the same formulas: what NumPy does to both, without the time that it takes for a float."""

import math
from functools import cache, lru_cache
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

Number = float | FloatArray
"""One float, or an array of any shape that broadcasts with the others."""

REMEMBERED = 256
"""Quantiles that are kept: some models' degrees of freedom at some probabilities."""

Truth = bool | np.bool_ | NDArray[np.bool_]


@cache
def special() -> ModuleType:
    """SciPy's special functions, which take longer to import than all else of this package, and as a statement in a
    function a microsecond each time.
    """
    from scipy import special

    return special


def student_quantile(degrees_of_freedom: float, level: Number) -> Number:
    """Quantile of Student's t, of one level or of an array of them; degrees of freedom may be infinite.

    Those of one level are remembered: a planner asks for the same few, and SciPy takes some microseconds for each.
    """
    if isinstance(level, np.ndarray):
        return np.asarray(special().stdtrit(degrees_of_freedom, level))
    return _remembered(degrees_of_freedom, float(level))


@lru_cache(maxsize=REMEMBERED)
def _remembered(degrees_of_freedom: float, level: float) -> float:
    return float(special().stdtrit(degrees_of_freedom, level))


def select(condition: Truth, yes: Number, no: Number) -> Number:
    """``yes`` where the condition holds."""
    return np.where(condition, yes, no) if isinstance(condition, np.ndarray) else (yes if condition else no)


def least(one: Number, other: Number) -> Number:
    """The smaller one."""
    return select(one < other, one, other)


def greatest(one: Number, other: Number) -> Number:
    """The larger one."""
    return select(one > other, one, other)


def hypot(one: Number, other: Number) -> Number:
    """Root of the sum of squares."""
    if isinstance(one, np.ndarray) or isinstance(other, np.ndarray):
        return np.hypot(one, other)
    return math.hypot(one, other)


def root(square: Number) -> Number:
    """Square root; 0 of what rounding made negative."""
    return greatest(square, 0.0) ** 0.5


def logarithm(value: Number) -> Number:
    """Natural logarithm."""
    return np.log(value) if isinstance(value, np.ndarray) else math.log(value)


def anywhere(condition: Any) -> bool:
    """Whether it holds of any."""
    return bool(condition.any() if isinstance(condition, np.ndarray) else condition)


def of_these(value: Number, where: NDArray[np.bool_]) -> Number:
    """The entries of an array that broadcasts to the shape of ``where``, where that holds; a float as it is."""
    return np.broadcast_to(value, where.shape)[where] if isinstance(value, np.ndarray) else value
