"""Delimited text: its lines, its cells, and numbers in them."""

import csv
import math
import re
from collections.abc import Iterator
from pathlib import Path

from service.formats.npy import MAX_ARRAY_BYTES
from slipcore.errors import InvalidInput

DELIMITERS = ",;\t"
DECIMAL_COMMA = re.compile(r"\s*[+-]?\d+,\d+(?:e[+-]?\d+)?\s*", re.IGNORECASE)
"""A number of a table that is parted by semicolons, as spreadsheets of many languages write it."""


def text_lines(path: Path) -> Iterator[str]:
    """The lines of a file; raises ``InvalidInput`` for one that is too large or is not UTF-8."""
    size = path.stat().st_size
    if size > MAX_ARRAY_BYTES:
        raise InvalidInput("file", f"{size} bytes", f"at most {MAX_ARRAY_BYTES} bytes")
    with path.open("rb") as stream:
        for number, line in enumerate(stream, start=1):
            try:
                yield line.decode("utf-8")
            except UnicodeDecodeError as error:
                raise InvalidInput(f"line {number}", f"not UTF-8 ({error.reason})", "UTF-8 text") from error


def split_header(text: str) -> tuple[list[str], str]:
    """The names in a header's line, and what parts them."""
    delimiter = max(DELIMITERS, key=text.count)
    return [name.strip(' "') for name in text.split(delimiter)], delimiter


def rows(lines: Iterator[str], delimiter: str, width: int, before: int, most: int) -> Iterator[tuple[int, list[str]]]:
    """Number and cells of each line that is neither empty nor a comment, after ``before`` lines.

    Raises ``InvalidInput`` for one of another ``width``, one that is no text, and where there are more than ``most``.
    """
    reader, count = csv.reader(lines, delimiter=delimiter), 0
    try:
        for cells in reader:
            if not cells or cells[0].lstrip().startswith("#"):
                continue
            count, line = count + 1, before + reader.line_num
            if count > most:
                raise InvalidInput("file", f"more than {most} rows", f"at most {most} rows")
            if len(cells) != width:
                raise InvalidInput(f"line {line}", f"of {len(cells)} cells", f"{width}, as in the header")
            yield line, [_with_point(cell) for cell in cells] if delimiter == ";" else cells
    except csv.Error as error:
        line = before + reader.line_num
        raise InvalidInput(f"line {line}", f"not a row of text ({error})", "delimited text") from error


def _with_point(cell: str) -> str:
    return cell.replace(",", ".") if DECIMAL_COMMA.fullmatch(cell) else cell


def parse_number(
    text: str, line: int, name: str, allowed: str = "a finite number; empty or nan where it is lost"
) -> float:
    """A number; NaN where the cell is empty. Raises ``InvalidInput`` naming line and column."""
    try:
        value = float(text) if text else math.nan
    except ValueError:
        value = math.inf
    if math.isinf(value) or "_" in text or not text.isascii():  # which Python takes in numbers, and nobody else
        raise InvalidInput(f"line {line}, {name}", repr(text)[:40], allowed)
    return value
