"""What commands print: lines and tables for people, JSON for programs."""

import json
import math
import sys
from collections.abc import Iterable, Mapping, Sequence
from datetime import datetime
from typing import Any
from unicodedata import category

import typer

from service.formatting import moment

LINE_WIDTH = 160
"""Columns of a table in a file or a pipe, which have no width of their own."""


def print_json(record: Mapping[str, Any]) -> None:
    """Print one JSON object; NaN and infinity become null, arrays become lists."""
    typer.echo(json.dumps(plain(record), ensure_ascii=False, indent=2))


def printable(text: str) -> str:
    """The text without what moves a terminal's cursor, sets its title or turns its direction: U+FFFD in its place."""
    return "".join("\ufffd" if category(letter) in {"Cc", "Cf"} else letter for letter in text)


def print_lines(title: str, lines: Iterable[tuple[str, str | None]]) -> None:
    """Print what is known of one thing, a line for each name and what is said of it; those of None are left out."""
    known = [(name, text) for name, text in lines if text is not None]
    width = max(len(name) for name, _ in known)
    typer.echo("\n".join(printable(line) for line in (title, *(f"  {name:<{width}}  {text}" for name, text in known))))


def print_table(title: str, columns: Sequence[str], rows: Sequence[Sequence[object]], width: int = LINE_WIDTH) -> None:
    """Print a table that is readable in a terminal, a log file and a pipe; a cell of None is empty.

    ``width``: columns in a file or a pipe.
    """
    from rich.box import SIMPLE_HEAD
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    typer.echo(printable(title))
    table = Table(box=SIMPLE_HEAD, show_edge=False)
    for column in columns:
        table.add_column(escape(column), overflow="fold")
    for row in rows:  # units are in brackets, as markup
        table.add_row(*("" if cell is None else escape(printable(str(cell))) for cell in row))
    is_terminal = sys.stdout is not None and sys.stdout.isatty()  # None: closed, as by `>&-`
    Console(width=None if is_terminal else width).print(table)


def when(text: str) -> str:
    """A moment of the service (ISO 8601), to the second."""
    return moment(datetime.fromisoformat(text))


def plain(value: Any) -> Any:
    """A copy of ``value`` that JSON can hold."""
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if hasattr(value, "tolist"):  # of numpy, which takes longer to import than all else of a command's help
        return plain(value.tolist())
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
