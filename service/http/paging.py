"""Lists over the wire: a limit, a cursor that leads to the next part, and how it is sorted."""

import base64
import binascii
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from typing import Any, TypeVar
from urllib.parse import quote

from fastapi import Request, Response

from db.paging import Window
from db.text import is_storable
from service.http.problems import INVALID_REQUEST, Problem

LARGEST_ID = 2**31 - 1
"""Of a PostgreSQL integer."""

Item = TypeVar("Item")


def _moment(value: Any) -> datetime:
    moment = datetime.fromisoformat(value)
    if moment.tzinfo is None:
        raise ValueError("no time zone")
    return moment.astimezone(UTC)  # the first and the last day of the calendar may have no moment there


def _text(value: Any) -> str:
    if not isinstance(value, str) or not is_storable(value):
        raise TypeError("no text that is stored")
    return value


def _number(value: Any) -> int:
    if type(value) is not int or not 0 <= value <= LARGEST_ID:
        raise ValueError("no id")
    return value


READERS: Mapping[str, Callable[[Any], Any]] = {"name": _text, "created_at": _moment, "id": _number, "hex": _text}
"""What a cursor may hold of an entry, and how it is read back."""


@dataclass(frozen=True, slots=True)
class Page:
    """One request for a part of a list; ``sort`` is a column's name, with ``-`` before it where the last come first."""

    sort: str
    limit: int
    cursor: str | None
    identity: str = "id"

    def window(self) -> Window:
        """What the database is asked for: one entry more shows whether there are more. Raises ``Problem``."""
        window = Window(self.sort.lstrip("-"), self.sort.startswith("-"), limit=self.limit + 1)
        return window if self.cursor is None else replace(window, after=self._after(self.cursor))

    def cut(self, found: Sequence[Item]) -> tuple[Sequence[Item], str | None]:
        """The entries of this page, and the cursor of the next one."""
        if len(found) <= self.limit:
            return found, None
        last: Any = found[self.limit - 1]
        value = getattr(last, self.sort.lstrip("-"))
        held = [self.sort, value.isoformat() if isinstance(value, datetime) else value, last.id]
        return found[: self.limit], base64.urlsafe_b64encode(json.dumps(held).encode()).decode()

    def _after(self, cursor: str) -> tuple[Any, Any]:
        try:
            sort, value, identity = json.loads(base64.urlsafe_b64decode(cursor.encode("ascii")))
            if sort != self.sort:
                raise ValueError("of another order")
            return READERS[self.sort.lstrip("-")](value), READERS[self.identity](identity)
        except (binascii.Error, ValueError, TypeError, OverflowError, RecursionError) as error:
            allowed = f"`next` of an answer sorted by {self.sort}"
            raise Problem.wrong_value(INVALID_REQUEST, "cursor", cursor, allowed) from error


def link_next(request: Request, response: Response, cursor: str | None) -> str | None:
    """Say in the headers too where the next page is (RFC 8288)."""
    if cursor is not None:
        query = request.url.include_query_params(cursor=cursor).query
        response.headers["Link"] = f'<{quote(request.url.path)}?{query}>; rel="next"'
    return cursor
