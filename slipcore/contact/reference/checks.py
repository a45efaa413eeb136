"""The one range check that all closed forms share."""

import math

from slipcore.arguments import number
from slipcore.errors import InvalidInput


def check_range(
    name: str,
    value: float,
    *,
    above: float | None = None,
    at_least: float | None = None,
    at_most: float | None = None,
    unit: str = "",
) -> float:
    """Give ``value`` back; raises ``InvalidInput`` that names it where it is no finite number or outside the bounds."""
    bounds = (("above", above), ("at least", at_least), ("at most", at_most))
    allowed = " and ".join(f"{word} {bound:.12g}" for word, bound in bounds if bound is not None)
    allowed = f"{allowed or ('a finite number of' if unit else 'a finite number')} {unit}".strip()
    given = number(name, value, allowed)
    inside = (
        math.isfinite(given)
        and (above is None or value > above)
        and (at_least is None or value >= at_least)
        and (at_most is None or value <= at_most)
    )
    if not inside:
        raise InvalidInput(name, f"{given:.12g} {unit}".strip(), allowed)
    return value
