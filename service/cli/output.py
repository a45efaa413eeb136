"""What commands print: a table for people, JSON for programs."""

import json
import math
import sys
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import typer

LINE_WIDTH = 160
"""Columns of a table in a file or a pipe, which have no width of their own."""


def print_json(record: Mapping[str, Any]) -> None:
    """Print one JSON object; NaN and infinity become null, arrays become lists."""
    typer.echo(json.dumps(plain(record), ensure_ascii=False, indent=2))


def print_table(title: str, columns: Sequence[str], rows: Sequence[Sequence[object]]) -> None:
    """Print a table that is readable in a terminal, a log file and a pipe."""
    from rich.box import SIMPLE_HEAD
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    table = Table(title=escape(title), title_justify="left", box=SIMPLE_HEAD)
    for column in columns:
        table.add_column(escape(column), overflow="fold")
    for row in rows:
        table.add_row(*(escape(str(cell)) for cell in row))  # units stand in brackets, as markup does
    Console(width=None if sys.stdout.isatty() else LINE_WIDTH).print(table)


def plain(value: Any) -> Any:
    """A copy of ``value`` that JSON can hold."""
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        return plain(value.tolist())
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
