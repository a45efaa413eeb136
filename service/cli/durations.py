"""Ages and moments as a command line prints them."""

import re
from datetime import UTC, datetime, timedelta

import typer

LONGEST = timedelta(days=36500)
"""As the settings have it: a moment so long ago is still a date."""

_UNITS = {"h": timedelta(hours=1), "d": timedelta(days=1)}


def duration(name: str, text: str) -> timedelta:
    """Hours or days, such as 12h or 90d; raises ``typer.BadParameter`` with the option's name."""
    found = re.fullmatch(r"(\d{1,6})([hd])", text, re.ASCII)
    if found is None or (length := int(found[1]) * _UNITS[found[2]]) > LONGEST:
        raise typer.BadParameter(
            f"{name} is {text}; allowed: hours or days such as 12h or 90d, at most {LONGEST.days}d"
        )
    return length


def in_words(length: timedelta) -> str:
    """Such as "7 days" or "12 h"."""
    days = length / _UNITS["d"]
    return f"{days:g} days" if days >= 2.0 else f"{length / _UNITS['h']:g} h"


def moment_to_come(name: str, text: str, now: datetime) -> datetime:
    """A duration from ``now``, or a date (its beginning in UTC) or moment of ISO 8601 after it."""
    try:
        moment = now + duration(name, text) if text[-1:] in _UNITS else datetime.fromisoformat(text)
        moment = moment.astimezone(UTC) if moment.tzinfo else moment.replace(tzinfo=UTC)
    except (ValueError, OverflowError) as error:
        raise typer.BadParameter(f"{name} is {text}; allowed: such as 90d, 12h or 2027-01-31") from error
    if moment <= now:
        raise typer.BadParameter(f"{name} is {text}, which is past; allowed: a moment to come")
    return moment
