"""Tables with one row a frame and a column a number, as loggers of tactile arrays write them, or with one row a frame
and element (docs/formats.md).
"""

import re
from array import array
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from service.formats.assemble import MASKS, MAX_CONTENT_BYTES, assemble
from service.formats.delimited import parse_number, rows, split_header, text_lines
from service.formats.mapping import UNMAPPED, FieldMapping, default_origins
from service.formats.members import of_all_frames
from slipcore.errors import InvalidInput
from slipcore.frames import FloatArray, GraspLog

MAX_ROWS = 5_000_000
TRUTH = {"True": "1", "False": "0"}
"""As pandas and ROS write them."""
MOST_STATES = 12
"""-, distinct numbers of a noted column that are counted one by one; of more, as of a measured quantity, the median
says more.
"""
OF_FRAMES = ("time", "object_pose", "gripper_force", "gripper_force_deviation", "sensor", "metadata", "element_area")
"""Members that are the same for all elements of a frame."""

ANY_NUMBER = "*"
"""In a field, stands for the number of an element: ``P*_FX`` are the columns P0_FX, P1_FX, … in their order."""


def read(path: Path, mapping: FieldMapping | None = None) -> GraspLog:
    """Read a grasp log from a table of frames. Raises ``InvalidInput`` naming the line, column or member."""
    table = _Table(path, mapping or UNMAPPED)
    log = assemble(table, table.mapping)
    notes = table.notes()
    taken = log.metadata.keys() & notes
    if taken:
        raise InvalidInput("notes", f"of the name {min(taken)!r}", "names that the metadata do not have yet")
    return replace(log, metadata={**log.metadata, **notes})


def looks_like(start: bytes) -> bool:
    """Whether a file that begins so is text with a header of several columns, at least one of them a name."""
    if b"\x00" in start:
        return False
    try:
        names, _, _ = _header(iter(start.decode("utf-8", errors="ignore").splitlines()))
    except InvalidInput:
        return False
    return len(names) > 1 and any(re.search("[A-Za-z]", name) for name in names)


class _Table:
    """The columns that a mapping names; a ``Recording``."""

    def __init__(self, path: Path, mapping: FieldMapping) -> None:
        lines = text_lines(path)
        self._names, delimiter, before = _header(lines)
        self._case = re.IGNORECASE if mapping.preset else re.NOFLAG
        self.mapping = mapping = self._chosen(mapping).over(default_origins())
        for name, origin in mapping.origins.items():
            self._check_same_elements(name, origin.fields)
        fields = [field for origin in mapping.origins.values() for field in origin.fields]
        fields += [*mapping.notes.values(), *([] if mapping.element is None else [mapping.element])]
        chosen = sorted({column for field in fields for column in self._columns(field)})
        self._place = {column: k for k, column in enumerate(chosen)}
        masks = [origin for name, origin in mapping.origins.items() if name in MASKS]
        of_masks = [field for origin in masks for field in origin.fields]
        stated = {column for field in (*of_masks, *mapping.notes.values()) for column in self._columns(field)}
        self._values = self._read(rows(lines, delimiter, len(self._names), before, MAX_ROWS), chosen, stated)
        self._order = None if mapping.element is None else self._of_elements(mapping.element)

    def column(self, name: str, _topic: str | None, field: str, once: bool) -> NDArray[Any] | None:
        """A column, or those of a field with a number in it side by side; None where there is none."""
        places = [self._place[column] for column in self._columns(field)]
        if not places:
            return None
        found: NDArray[Any] = self._values[:, places if ANY_NUMBER in field else places[0]]
        if self._order is not None:
            found = found[self._order]
            found = self._one_a_frame(name, found) if name in OF_FRAMES else found
        if name in MASKS and np.isin(found, (0.0, 1.0)).all():
            found = found == 1.0
        return of_all_frames(name, found) if once else found

    @staticmethod
    def _one_a_frame(name: str, found: NDArray[Any]) -> NDArray[Any]:
        """What all rows of a frame state alike, of ``found`` [t, e, ...]."""
        other = np.argwhere(found != found[:, :1])
        if len(other):
            frame, row, *component = other[0]
            values = f"{found[frame, 0, *component]:g} and {found[frame, row, *component]:g} in rows of frame {frame}"
            raise InvalidInput(name, values, "one value in all rows of a frame")
        return np.asarray(found[:, 0])

    def grid(self) -> None:
        """Given by the mapping alone."""

    def _chosen(self, mapping: FieldMapping) -> FieldMapping:
        """The first of a preset's alternatives whose columns are there, those apart that need not be."""
        if not mapping.preset:
            return mapping
        nearest = min((mapping, *mapping.alternatives), key=lambda each: len(self._missing(each)))
        if missing := self._missing(nearest):
            raise InvalidInput("preset", f"of columns {', '.join(missing)}, not there"[:200], self.contents())
        return nearest

    def _missing(self, mapping: FieldMapping) -> list[str]:
        """Fields that must be there, and are not."""
        fields = [field for origin in mapping.origins.values() if origin.explicit for field in origin.fields]
        return [field for field in fields if not self._columns(field)]

    def notes(self) -> dict[str, str]:
        """What the columns to be noted hold: how often each of a few numbers, or the median of many."""
        notes = {}
        for name, field in self.mapping.notes.items():
            found = self._values[:, [self._place[column] for column in self._columns(field)]]
            numbers, times = np.unique(found[np.isfinite(found)], return_counts=True)
            if 0 < len(numbers) <= MOST_STATES:
                notes[name] = ", ".join(
                    f"{number:g} {count} times" for number, count in zip(numbers, times, strict=True)
                )
            elif len(numbers):
                notes[name] = f"median {np.nanmedian(found):.4g} of {int(times.sum())}"
        return notes

    def contents(self) -> str:
        """The columns, those of numbered elements as a field names them."""
        numbered = [re.sub(r"\d{1,6}", ANY_NUMBER, name, count=1, flags=re.ASCII) for name in self._names]
        times = Counter(numbered)
        told = dict.fromkeys(
            field if times[field] > 1 else name for name, field in zip(self._names, numbered, strict=True)
        )
        return f"the columns {', '.join(told)}"[:300]

    def _columns(self, field: str) -> list[int]:
        if ANY_NUMBER not in field:
            return [self._names.index(field)] if field in self._names else []
        return [column for _, column in self._numbered(field)]

    def _numbered(self, field: str) -> list[tuple[int, int]]:
        """Numbers of elements, and their columns, in order. Manuals differ in the case of a preset's names."""
        pattern = re.compile(r"(\d{1,6})".join(map(re.escape, field.split(ANY_NUMBER, 1))), re.ASCII | self._case)
        found = [(int(match[1]), k) for k, name in enumerate(self._names) if (match := pattern.fullmatch(name))]
        return sorted(found)

    def _of_elements(self, element: str) -> NDArray[np.intp]:
        """The row of each frame and element [t, e], in the order of time and of the elements' numbers."""
        fields = (element, *self.mapping.origins["time"].fields)
        missing = [field for field in fields if not self._columns(field)]
        if missing or len(fields) != 2:
            raise InvalidInput("element", f"without {', '.join(missing) or 'a column of time'}"[:100], self.contents())
        column, time = (self._values[:, self._place[self._columns(field)[0]]] for field in fields)
        order = np.lexsort((column, time))
        frames, elements = len(np.unique(time)), len(np.unique(column))
        if len(order) == frames * elements:
            table = order.reshape(frames, elements)
            if (time[table] == time[table[:, :1]]).all() and (column[table] == column[table[0]]).all():
                return table
        counts = f"{len(order)} rows of {frames} times and {elements} elements, {_odd_one(time, column)}"
        raise InvalidInput("element", counts, "a row for each once; a marker that is lost with `observed` 0")

    def _check_same_elements(self, name: str, fields: Sequence[str]) -> None:
        """Components side by side must be of the same elements, each there once."""
        numbers = [[number for number, _ in self._numbered(field)] for field in fields if ANY_NUMBER in field]
        if any(numbers) and [] in numbers:
            missing = [field for field in fields if not self._columns(field)]
            raise InvalidInput(name, f"not there ({missing[0]})"[:100], self.contents())
        if any(each != numbers[0] or len(set(each)) < len(each) for each in numbers):
            found = "; ".join(f"{', '.join(map(str, each[:9]))}" for each in numbers)
            raise InvalidInput(name, f"of the elements {found}"[:200], "the same in each component, each once")
        for lower, upper in pairwise(numbers[0] if numbers else ()):
            if upper == lower + 2 and numbers[0][-1] - numbers[0][0] == len(numbers[0]):  # else numbered otherwise
                raise InvalidInput(name, f"of elements {lower} and {upper}, not {lower + 1}", "numbers without a gap")

    def _read(self, lines: Iterator[tuple[int, list[str]]], chosen: list[int], stated: set[int]) -> FloatArray:
        """The ``chosen`` columns; ``True`` and ``False`` are numbers in those ``stated`` alone, and no force."""
        values = array("d")
        for line, cells in lines:
            values.extend(
                parse_number(
                    TRUTH.get(text := cells[column].strip(), text) if column in stated else cells[column].strip(),
                    *(line, self._names[column], "a finite number"),
                )
                for column in chosen
            )
            if len(values) * values.itemsize > MAX_CONTENT_BYTES:
                raise InvalidInput("file", f"more than {MAX_CONTENT_BYTES} bytes", f"at most {MAX_CONTENT_BYTES}")
        if not values:
            allowed = "rows, and a mapping that names columns"
            raise InvalidInput("file", f"without rows of what is looked for; it has {self.contents()}", allowed)
        return np.frombuffer(values).reshape(-1, len(chosen))


def _odd_one(time: FloatArray, element: FloatArray) -> str:
    """The first time at which an element, of those of a table's rows, has no row or several."""
    if not (np.isfinite(time).all() and np.isfinite(element).all()):
        return "one without a number"
    (times, frame), (elements, column) = (np.unique(each, return_inverse=True) for each in (time, element))
    there = np.sort(frame * len(elements) + column)
    odd = np.append(there != np.arange(len(there)), True).argmax()
    place, count = (odd, "none") if odd == len(there) or there[odd] > odd else (there[odd], "several")
    return f"{count} of element {elements[place % len(elements)]:g} at {times[place // len(elements)]:g}"


def _header(lines: Iterator[str]) -> tuple[list[str], str, int]:
    """Names, each of which is there once, what parts them, and the number of the header's line."""
    for number, line in enumerate(lines, start=1):
        text = line.strip("\ufeff \r\n")
        if text and not text.startswith("#"):
            names, delimiter = split_header(text)
            return _distinct(names), delimiter, number
    raise InvalidInput("file", "without a header", "a line that names the columns")


def _distinct(names: list[str]) -> list[str]:
    """Names that come again, as of a second sensor, get its number: ``P0_FX``, ``P0_FX.1``."""
    seen: dict[str, int] = {}
    found = []
    for name in names:
        count = seen[name] = seen.get(name, -1) + 1
        found.append(f"{name}.{count}" if count else name)
    if len(set(found)) < len(found):
        twice = next(name for name in found if found.count(name) > 1)
        raise InvalidInput("file", f"with two columns {twice[:40]!r}", "names that stay distinct with their number")
    return found
