"""Named numbers that change results, each with its meaning: what the tables of defaults are made of."""

from dataclasses import dataclass, fields
from typing import NamedTuple, get_type_hints


class Option(NamedTuple):
    """What an option means: valid range (both ends allowed), unit, and where its default comes from."""

    low: float
    high: float
    unit: str
    source: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Options:
    """Named options, each annotated with what it means."""


def describe_options(kind: type[Options]) -> dict[str, Option]:
    """Unit, valid range and source of every option of a table, by name."""
    hints = get_type_hints(kind, include_extras=True)
    return {entry.name: hints[entry.name].__metadata__[0] for entry in fields(kind)}
