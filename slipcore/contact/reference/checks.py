"""The one range check that all closed forms share."""

import math

import numpy as np

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
    inside = (
        _is_finite(value)
        and (above is None or value > above)
        and (at_least is None or value >= at_least)
        and (at_most is None or value <= at_most)
    )
    if not inside:
        bounds = (("above", above), ("at least", at_least), ("at most", at_most))
        allowed = " and ".join(f"{word} {bound:.12g}" for word, bound in bounds if bound is not None)
        allowed = allowed or ("a finite number of" if unit else "a finite number")
        is_number = isinstance(value, float | np.floating) or _is_finite(value)
        shown = f"{value:.12g} {unit}".strip() if is_number else repr(value)[:60]
        raise InvalidInput(name, shown, f"{allowed} {unit}".strip())
    return value


def _is_finite(value: object) -> bool:
    """Whether it is a finite number; ``True`` is none."""
    try:
        return not isinstance(value, bool | np.bool_) and math.isfinite(value)  # type: ignore[arg-type]
    except (TypeError, OverflowError):
        return False
