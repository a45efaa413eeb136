"""Parts of a list: by keys rather than by numbers, so that what comes in or goes meanwhile shifts nothing."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, TypeVar

from sqlalchemy import ColumnElement, Select, literal, tuple_
from sqlalchemy.orm import InstrumentedAttribute

Query = TypeVar("Query", bound=Select[*tuple[Any, ...]])


@dataclass(frozen=True, slots=True)
class Window:
    """The part of a list that is asked for: sorted by what, after which entry, and at most how many (None: all).

    ``after`` holds the entry's value of ``sort`` and its id, which tells entries apart whose value is the same.
    """

    sort: str
    descending: bool = False
    after: tuple[Any, Any] | None = None
    limit: int | None = None


BY_NAME = Window("name")
"""All of it."""


def windowed(
    query: Query,
    window: Window,
    columns: Mapping[str, InstrumentedAttribute[Any]],
    identity: InstrumentedAttribute[Any],
) -> Query:
    """The query for a part of a list; ``columns`` are those that it may be sorted by."""
    key = (columns[window.sort], identity)
    if window.after is not None:
        here = tuple_(*key)
        entry = tuple_(*(literal(value, column.type) for value, column in zip(window.after, key, strict=True)))
        query = query.where(here < entry if window.descending else here > entry)
    order: list[ColumnElement[Any]] = [column.desc() if window.descending else column.asc() for column in key]
    return query.order_by(*order).limit(window.limit)
