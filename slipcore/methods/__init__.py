"""The detection methods, one algorithm a file, by name."""

from typing import Any

from slipcore.errors import InvalidInput
from slipcore.methods import strain_rate, strain_rate_literal
from slipcore.methods.interface import Method

METHODS: dict[str, Method[Any, Any]] = {
    "strain_rate": strain_rate.METHOD,
    "strain_rate_literal": strain_rate_literal.METHOD,
}
"""A further method joins by a file of its own and a line here."""


def find_method(name: str) -> Method[Any, Any]:
    """The method of that name; raises ``InvalidInput`` listing those that exist."""
    try:
        return METHODS[name]
    except (KeyError, TypeError):
        raise InvalidInput("method", name, ", ".join(METHODS)) from None
