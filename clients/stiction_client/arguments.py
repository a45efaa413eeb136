"""What callers may pass: numbers, and arrays of them, within their range."""

import math
from collections.abc import Mapping
from types import NoneType, UnionType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stiction_client.elementwise import Number
from stiction_client.errors import InvalidArgument

ONE = (float, int, NoneType)
"""Types of what is no array."""


def within(name: str, value: object, low: float, high: float, unit: str = "") -> Number:
    """``value`` as a float, or an array of them, all in [low, high]; raises ``InvalidArgument`` for anything else."""
    if isinstance(value, float) or (type(value) is int and abs(value) < 2**53):
        number = float(value)
        if low <= number <= high:
            return number
        raise InvalidArgument(name, value, _range(low, high, unit))
    array = as_array(name, value)
    if array.dtype.kind not in "iuf" or _holds_truth(value) or np.ma.is_masked(value):
        raise InvalidArgument(name, shown(value), f"numbers: {_range(low, high, unit)}")
    numbers = array.astype(np.float64)
    wrong = ~((low <= numbers) & (numbers <= high))
    if wrong.any():
        raise InvalidArgument(name, float(numbers[wrong][0]), _range(low, high, unit))
    return numbers if numbers.ndim else float(numbers)


def number(name: str, value: object, low: float, high: float, unit: str = "") -> float:
    """One number in [low, high]; raises ``InvalidArgument`` for anything else, an array among it."""
    one = within(name, value, low, high, unit)
    if not isinstance(one, float):
        raise InvalidArgument(name, shown(value), f"one number: {_range(low, high, unit)}")
    return one


def whole(name: str, value: object, low: int, high: int, unit: str = "") -> int:
    """One whole number in [low, high]; raises ``InvalidArgument`` for anything else."""
    found = within(name, value, low, high, unit)
    if not isinstance(found, float) or not found.is_integer():
        raise InvalidArgument(name, shown(value), f"a whole number: {_range(low, high, unit)}")
    return int(found)


def as_array(name: str, value: object) -> NDArray[Any]:
    """``value`` as an array of whatever it holds; raises ``InvalidArgument`` for lists of unequal lengths in a list."""
    try:
        return np.asarray(value)
    except ValueError:
        raise InvalidArgument(name, shown(value), "one number, or an array of them") from None


def of_one_shape(**given: object) -> None:
    """Raises ``InvalidArgument`` for arrays that do not broadcast, with their names and shapes."""
    shapes = {name: as_array(name, value).shape for name, value in given.items() if not isinstance(value, ONE)}
    if not shapes:
        return
    try:
        np.broadcast_shapes(*shapes.values())
    except ValueError:
        sized = {name: str(list(shape)) for name, shape in shapes.items() if shape}
        allowed = "one length, or any shapes that broadcast"
        raise InvalidArgument(" and ".join(sized), " and ".join(sized.values()), allowed) from None


def of_kind(name: str, value: object, kind: type | UnionType) -> None:
    """Raises ``InvalidArgument`` for a value that is no ``kind``."""
    if not isinstance(value, kind):
        kinds = " or ".join(each.__name__ for each in (kind.__args__ if isinstance(kind, UnionType) else (kind,)))
        raise InvalidArgument(name, shown(value), f"an object of {kinds}")


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


def _holds_truth(value: object) -> bool:
    """Whether a list has ``True`` or ``False`` among its numbers, which NumPy takes for 1 and 0."""
    if not isinstance(value, list | tuple):
        return False
    return any(_holds_truth(each) or isinstance(each, bool | np.bool_) for each in value)


def _range(low: float, high: float, unit: str) -> str:
    return f"{low:g} to {high:g} {unit}".strip()


def shown(value: object) -> str:
    """A value as a message shows it."""
    return repr(value)[:60]
