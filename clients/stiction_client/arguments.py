"""What callers may pass: numbers, and arrays of them, within their range."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from stiction_client.elementwise import Number
from stiction_client.errors import InvalidArgument


def within(name: str, value: object, low: float, high: float, unit: str = "") -> Number:
    """``value`` as a float, or an array of them, all in [low, high]; raises ``InvalidArgument`` for anything else."""
    if isinstance(value, float) or (type(value) is int and abs(value) < 2**53):
        number = float(value)
        if low <= number <= high:
            return number
        raise InvalidArgument(name, value, _range(low, high, unit))
    array = np.asarray(value)
    if array.dtype.kind not in "iuf":
        raise InvalidArgument(name, shown(value), f"numbers: {_range(low, high, unit)}")
    numbers = array.astype(np.float64)
    wrong = ~((low <= numbers) & (numbers <= high))
    if wrong.any():
        raise InvalidArgument(name, float(numbers[wrong][0]), _range(low, high, unit))
    return numbers if numbers.ndim else float(numbers)


def whole(name: str, value: object, low: int, high: int, unit: str = "") -> int:
    """One whole number in [low, high]; raises ``InvalidArgument`` for anything else."""
    number = within(name, value, low, high, unit)
    if not isinstance(number, float) or not number.is_integer():
        raise InvalidArgument(name, shown(value), f"a whole number: {_range(low, high, unit)}")
    return int(number)


def of_kind(name: str, value: object, kind: type) -> None:
    """Raises ``InvalidArgument`` for a value that is no ``kind``."""
    if not isinstance(value, kind):
        raise InvalidArgument(name, shown(value), f"an object of {kind.__name__}")


def number_of_items(limit: object) -> float:
    """How many items a ``limit`` allows, any number where it is None; raises ``InvalidArgument`` for another value."""
    if limit is None:
        return math.inf
    if not isinstance(limit, int | np.integer) or isinstance(limit, bool) or limit < 1:
        raise InvalidArgument("limit", shown(limit), "a whole number from 1, or None for all")
    return int(limit)


def for_json(name: str, value: object) -> Any:
    """``value`` of plain numbers, text, lists and objects, numpy's among them; raises ``InvalidArgument`` naming what
    JSON does not have.
    """
    if isinstance(value, Mapping):
        return {str(key): for_json(str(key), each) for key, each in value.items()}
    if isinstance(value, np.generic | np.ndarray):
        value = value.tolist()
    if isinstance(value, list | tuple):
        return [for_json(name, each) for each in value]
    if isinstance(value, float) and not math.isfinite(value):
        raise InvalidArgument(name, value, "a finite number")
    if value is None or isinstance(value, str | int | float):
        return value
    raise InvalidArgument(name, shown(value), "numbers, text, and lists and objects of these")


def _range(low: float, high: float, unit: str) -> str:
    return f"{low:g} to {high:g} {unit}".strip()


def shown(value: object) -> str:
    """A value as a message shows it."""
    return repr(value)[:60]
