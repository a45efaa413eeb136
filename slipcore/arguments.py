"""What callers may pass: numbers, arrays of them, and objects of a kind."""

from numbers import Integral, Real
from types import NoneType, UnionType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from slipcore.errors import InvalidInput


def number(name: str, value: object, allowed: str = "a number") -> float:
    """``value`` as a float; raises ``InvalidInput`` for what is no single real number, a truth value among it."""
    lone = isinstance(value, np.ndarray) and value.ndim == 0 and not np.ma.is_masked(value)
    one = value.item() if lone else value  # type: ignore[attr-defined]
    if isinstance(one, bool) or not isinstance(one, Real):
        raise InvalidInput(name, shown(value), allowed)
    try:
        return float(one)
    except OverflowError:  # a whole number that no float holds
        raise InvalidInput(name, shown(value), allowed) from None


def whole(name: str, value: object, low: int, high: int) -> int:
    """One whole number in [low, high]; raises ``InvalidInput`` for anything else."""
    is_whole = isinstance(value, Integral) and not isinstance(value, bool)
    if not is_whole or not low <= value <= high:  # type: ignore[operator]
        raise InvalidInput(name, shown(value), f"a whole number, {low} to {high}")
    return int(value)  # type: ignore[call-overload, no-any-return]


def real_array(name: str, value: object) -> NDArray[Any]:
    """``value`` as an array of numbers; raises ``InvalidInput`` for what would convert, and mean something else."""
    allowed = "an array of real numbers"
    given = array_of(name, value, allowed)
    if given.dtype.kind not in "iuf":  # text, dates and complex numbers
        raise InvalidInput(name, f"of dtype {given.dtype}", allowed)
    return given


def array_of(name: str, value: object, allowed: str) -> NDArray[Any]:
    """``value`` as an array; raises ``InvalidInput`` for rows of different lengths, and for numbers that are masked."""
    if np.ma.is_masked(value):
        raise InvalidInput(name, "an array with masked numbers", allowed)
    try:
        return np.asarray(value)
    except ValueError as error:
        raise InvalidInput(name, f"not an array ({error})", allowed) from error


def of_kind(name: str, value: object, kind: type | UnionType) -> None:
    """Raises ``InvalidInput`` for a value that is no ``kind``."""
    if not isinstance(value, kind):
        kinds = kind.__args__ if isinstance(kind, UnionType) else (kind,)
        allowed = " or ".join("None" if each is NoneType else each.__name__ for each in kinds)
        raise InvalidInput(name, shown(value), allowed)


def shown(value: object) -> str:
    """A value as a message shows it."""
    return repr(value)[:60]
