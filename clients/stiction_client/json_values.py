"""Values parsed from JSON, of an answer or a file, checked for type and range before they are believed."""

import math
from typing import Any

import numpy as np

from stiction_client.elementwise import FloatArray

ROUNDING = 1e-6
"""Share of the standard deviations by which a covariance may fall short of one: float64 leaves 1e-12."""


LARGEST = 1e100
"""Size of a number, far beyond what any fit gives, whose square is one still."""


def number(name: str, value: object, *, least: float = -math.inf, above: float = -math.inf) -> float:
    """A number of at least ``least`` and above ``above``; raises ``ValueError`` naming another thing."""
    if isinstance(value, (bool, np.bool_)) or not isinstance(value, (int, float, np.integer, np.floating)):
        raise ValueError(f"{name}, which is {value!r:.40}, no number")
    if not abs(value if isinstance(value, int) else float(value)) <= LARGEST:
        raise ValueError(f"{name}, which is {value!r:.40}; allowed: finite, of a size up to {LARGEST:g}")
    found = float(value)
    if not (found >= least and found > above):
        allowed = f"above {above:g}" if math.isfinite(above) else f"{least:g} or more"
        raise ValueError(f"{name}, which is {found:g}; allowed: finite, {allowed}")
    return found


def whole(name: str, value: object, *, least: int) -> int:
    """A whole number of at least ``least``; raises ``ValueError`` naming another thing."""
    found = number(name, value, least=least)
    if found != int(found):
        raise ValueError(f"{name}, which is {found:g}, no whole number")
    return int(found)


def text(name: str, value: object) -> str:
    """Text; raises ``ValueError`` naming another thing."""
    if not isinstance(value, str):
        raise ValueError(f"{name}, which is {value!r:.40}, no text")
    return value


def members(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """An object of JSON; raises ``ValueError`` for a member that stands twice, of which one would count."""
    found = dict(pairs)
    if len(found) < len(pairs):
        names = [name for name, _ in pairs]
        raise ValueError(f"{next(name for name in names if names.count(name) > 1)}, which stands twice")
    return found


def truth(name: str, value: object) -> bool:
    """``true`` or ``false``; raises ``ValueError`` for another thing, which Python may take for either."""
    if not isinstance(value, (bool, np.bool_)):
        raise ValueError(f"{name}, which is {value!r:.40}, neither true nor false")
    return bool(value)


def degrees_of_freedom(value: object) -> float:
    """As JSON has them: null is infinitely many, a normal distribution."""
    return math.inf if value is None else number("degrees_of_freedom", value, above=0.0)


def span(name: str, values: Any) -> tuple[float, float]:
    """A range of sizes, whose ends stand in order."""
    low, high = (number(name, each, least=0.0) for each in values)
    if low > high:
        raise ValueError(f"{name}, from {low:g} to {high:g}; allowed: in ascending order")
    return low, high


def coefficients(values: Any) -> FloatArray:
    """Three finite numbers."""
    return np.array([number("coefficients", each) for each in values], dtype=np.float64).reshape(3)


def covariance(values: Any) -> FloatArray:
    """[3, 3], symmetric and of no negative variance in any direction; raises ``ValueError``."""
    found = np.array([[number("covariance", each) for each in row] for row in values], dtype=np.float64).reshape(3, 3)
    variance = found.diagonal()
    if (variance < 0.0).any():
        raise ValueError(f"covariance, with the variance {variance.min():g}")
    size = np.sqrt(np.outer(variance, variance))
    if (np.abs(found - found.T) > ROUNDING * size).any():
        raise ValueError("covariance, which is not symmetric")
    correlation = np.divide(found, size, out=np.zeros_like(found), where=size > 0.0)
    if (found[size == 0.0] != 0.0).any() or np.linalg.eigvalsh(correlation).min() < -ROUNDING:
        raise ValueError("covariance, by which some friction has a negative variance")
    return found
