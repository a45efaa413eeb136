"""What callers may pass beside samples: refused by name, as samples are."""

from collections.abc import Callable
from numbers import Integral
from types import UnionType

from estimators.errors import InvalidSamples
from slipcore.arguments import number, of_kind, shown
from slipcore.errors import InvalidInput


def check_number(name: str, value: object, inside: Callable[[float], bool], allowed: str) -> None:
    """Raises ``InvalidSamples`` for what is no number, or not ``inside`` what is ``allowed``."""
    try:
        is_allowed = inside(number(name, value, allowed))
    except InvalidInput as error:
        raise InvalidSamples(error.name, error.value, error.allowed) from None
    if not is_allowed:
        raise InvalidSamples(name, value, allowed)


def check_whole(name: str, value: object, least: int) -> None:
    """Raises ``InvalidSamples`` for what is no whole number of ``least`` or more."""
    if isinstance(value, bool) or not isinstance(value, Integral) or int(value) < least:
        raise InvalidSamples(name, shown(value), f"a whole number, at least {least}")


def check_kind(name: str, value: object, kind: type | UnionType) -> None:
    """Raises ``InvalidSamples`` for a value that is no ``kind``."""
    try:
        of_kind(name, value, kind)
    except InvalidInput as error:
        raise InvalidSamples(error.name, error.value, error.allowed) from None
