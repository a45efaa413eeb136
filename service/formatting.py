"""Numbers and moments as people read them: sensible digits, a unit with each, no ``nan`` and no ``None``."""

import math
from collections.abc import Sequence
from datetime import UTC, datetime

NOTHING = "–"
"""In place of a number that there is not."""

MINUS = "−"
_AGES = ((86400.0 * 365.25, "year"), (86400.0, "day"), (3600.0, "hour"), (60.0, "minute"))
_BYTES = ((10**9, "GB"), (10**6, "MB"), (10**3, "kB"))


def number(value: float | None, digits: int = 3) -> str:
    """So many significant digits, zeros at the end among them; a power of ten where zeros would be counted."""
    if value is None or not math.isfinite(value):
        return NOTHING
    if value == 0.0:
        return "0"
    text = f"{value:#.{digits}g}".removesuffix(".")
    if "e" in text and 1e-4 <= abs(value) < 1e6:
        text = f"{float(text):.0f}"
    elif "e" in text:
        mantissa, exponent = text.split("e")
        text = f"{mantissa} × 10{str(int(exponent)).translate(_RAISED)}"
    return text.replace("-", MINUS)


def at_least(value: float, digits: int = 3) -> str:
    """So many significant digits, rounded up: for what must not be too small, as a force that holds."""
    if not math.isfinite(value) or value <= 0.0:
        return number(value, digits)
    unit = 10.0 ** (math.floor(math.log10(value)) - digits + 1)
    return number(math.ceil(value / unit - 1e-9) * unit, digits)


def renamed(text: str, name: str, told: str) -> str:
    """What is said of a wrong value, which is ``told`` in place of its ``name``; as it is where it is of another."""
    rest = text.removeprefix(f"{name} is ")
    return text if rest == text else f"{told} is {rest}"


def further_warning(warning: str | None, advice: str) -> str:
    """What a warning says beyond the advice that stands above it, part of which or all of which it may be."""
    rest = (warning or "").replace(advice, "")
    return "; ".join(part for part in rest.split("; ") if part and part not in advice)


_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def interval(bounds: Sequence[float | None] | None, digits: int = 3) -> str:
    """The two ends of a range."""
    return NOTHING if bounds is None else f"{number(bounds[0], digits)} … {number(bounds[1], digits)}"


def age(moment: datetime, now: datetime | None = None) -> str:
    """How long ago a moment was."""
    seconds = ((now or datetime.now(UTC)) - moment).total_seconds()
    for size, name in _AGES:
        if seconds >= size:
            count = int(seconds // size)
            return f"{count} {name}{'s' if count > 1 else ''} ago"
    return "just now"


def moment(value: datetime) -> str:
    """A moment to the second, in UTC."""
    return value.strftime("%Y-%m-%d %H:%M:%S UTC")


def size(count: int) -> str:
    """A number of bytes."""
    return next((f"{count / unit:.3g} {name}" for unit, name in _BYTES if count >= unit), f"{count} bytes")


def grouped(count: int) -> str:
    """A whole number, its thousands apart."""
    return f"{count:,}".replace(",", "\N{NARROW NO-BREAK SPACE}")
