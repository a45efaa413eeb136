"""Checks of what callers pass beside samples: like samples, it is refused by ``InvalidSamples``."""

import math
from collections.abc import Callable, Collection
from numbers import Integral
from types import UnionType

from estimators.errors import InvalidSamples
from slipcore.arguments import number, of_kind, shown
from slipcore.errors import InvalidInput


def above_zero(value: float) -> bool:
    """Above 0 and finite."""
    return 0.0 < value < math.inf


def at_least_zero(value: float) -> bool:
    """0 or above, and finite."""
    return 0.0 <= value < math.inf


def between_zero_and_one(value: float) -> bool:
    """Above 0 and below 1."""
    return 0.0 < value < 1.0


def check_number(name: str, value: object, inside: Callable[[float], bool], allowed: str) -> None:
    """Raises ``InvalidSamples`` for a value that is no number, or not ``inside`` its range; ``allowed`` tells which."""
    try:
        is_allowed = inside(number(name, value, allowed))
    except InvalidInput as error:
        raise InvalidSamples(error.name, error.value, error.allowed) from None
    if not is_allowed:
        raise InvalidSamples(name, value, allowed)


def check_whole(name: str, value: object, least: int) -> None:
    """Raises ``InvalidSamples`` for a value that is no whole number of ``least`` or more."""
    if isinstance(value, bool) or not isinstance(value, Integral) or int(value) < least:
        raise InvalidSamples(name, shown(value), f"a whole number, at least {least}")


def check_choice(name: str, value: object, choices: Collection[str]) -> None:
    """Raises ``InvalidSamples`` for a value that is none of the ``choices``."""
    if not isinstance(value, str) or value not in choices:
        raise InvalidSamples(name, value, ", ".join(choices))


def check_kind(name: str, value: object, kind: type | UnionType) -> None:
    """Raises ``InvalidSamples`` for a value that is no ``kind``."""
    try:
        of_kind(name, value, kind)
    except InvalidInput as error:
        raise InvalidSamples(error.name, error.value, error.allowed) from None
