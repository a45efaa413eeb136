"""Parquet tables with one row a frame, LeRobot v3's data files among them (docs/formats.md)."""

import json
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

from service.formats import lerobot
from service.formats import mapping as mappings
from service.formats.assemble import MAX_CONTENT_BYTES, as_array, assemble
from service.formats.json_text import parse_object
from service.formats.mapping import FieldMapping, Origin, default_origins
from service.formats.members import DTYPES, ONCE, of_all_frames
from slipcore.errors import InvalidInput
from slipcore.frames import GraspLog
from stiction_client.container import members

MAPPING_KEY, LOG_KEY = b"stiction_mapping", b"stiction_log"
"""Entries of the table's metadata: the mapping, and a JSON object of the members that there is one of a log."""

MAX_ROWS = 1_000_000
MAX_FOOTER_BYTES = 16 * 2**20
EPISODE = "episode_index"

_LISTS = (pa.types.is_list, pa.types.is_large_list, pa.types.is_fixed_size_list)
_VALUES = (pa.types.is_integer, pa.types.is_floating, pa.types.is_boolean, pa.types.is_timestamp)


def read(path: Path, mapping: FieldMapping | None = None) -> GraspLog:
    """Read a grasp log from a Parquet file, or the mapping's episode from the folder of a LeRobot data set.

    Raises ``InvalidInput`` naming the member or column that is wrong.
    """
    if path.is_dir():
        chosen, mapping = lerobot.episode(path, mapping)
        log = read(chosen.file, mapping)
        return log if chosen.task is None else replace(log, metadata={**log.metadata, "task": chosen.task})
    with _library():
        _check_footer(path)
        with pq.ParquetFile(path, pre_buffer=False, thrift_string_size_limit=MAX_FOOTER_BYTES) as file:
            table = _Columns(file, mapping)
            return assemble(table, table.mapping)


def write(log: GraspLog, path: Path) -> None:
    """Write a grasp log as a Parquet table, one row a frame, that ``read`` turns into the same log bit for bit."""
    arrays = members(log)
    frames = {name: array for name, array in arrays.items() if name in DTYPES and name not in ONCE}
    once = {name: arrays[name].tolist() for name in ONCE if name in arrays}
    table = pa.table({name: _column(array) for name, array in frames.items()}, metadata={LOG_KEY: json.dumps(once)})
    split = [name + ".list.element" * (array.ndim - 1) for name, array in frames.items() if array.dtype.kind == "f"]
    pq.write_table(table, path, compression="zstd", use_dictionary=False, use_byte_stream_split=split)


def _column(array: NDArray[Any]) -> pa.Array:
    """Rows of fixed-size lists, nested as the array's axes are."""
    column = pa.array(array.reshape(-1))
    for length in reversed(array.shape[1:]):
        column = pa.FixedSizeListArray.from_arrays(column, length)
    return column


class _Columns:
    """The columns of a table; a ``Recording``."""

    def __init__(self, file: pq.ParquetFile, mapping: FieldMapping | None) -> None:
        if file.metadata.num_rows > MAX_ROWS:
            raise InvalidInput("file", f"{file.metadata.num_rows} rows by its header", f"at most {MAX_ROWS} rows")
        self._file = file
        self._names = set(file.schema_arrow.names)
        notes = file.schema_arrow.metadata or {}
        self._log = parse_object("stiction_log", notes.get(LOG_KEY, b"{}"))
        own = mappings.parse(notes[MAPPING_KEY].decode("utf-8", "replace")) if MAPPING_KEY in notes else None
        self.mapping = mappings.chosen_over(mapping, own).over(self._defaults())
        self._bytes = 0
        self._groups: Sequence[int] = range(file.metadata.num_row_groups)
        self._rows = self._episode()

    def column(self, name: str, _topic: str | None, field: str, once: bool) -> NDArray[Any] | None:
        """A column with an entry a row, or ``once`` what all rows state; None where it isn't there."""
        if once and field == name and name in self._log:
            return as_array(name, self._log[name])
        if field not in self._names:
            return None
        array = self._read(name, field)
        if isinstance(self._rows, np.ndarray) and len(array) != len(self._rows):
            raise InvalidInput(name, f"of {len(array)} rows", f"{len(self._rows)} rows, as in {EPISODE}")
        array = array[self._rows]
        return of_all_frames(name, array) if once and len(array) else array

    def grid(self) -> None:
        """Given by the arrays' shapes alone."""

    def contents(self) -> str:
        """The columns."""
        return f"the columns {', '.join(sorted(self._names))}"[:300]

    def _defaults(self) -> dict[str, Origin]:
        """The members' own names, or in a LeRobot dataset names that begin with ``observation.``.

        Without ``observation.time`` there, time is the ``timestamp``, which runs evenly and in single precision.
        """
        if "time" in self._names or "timestamp" not in self._names:
            return default_origins()
        lerobot = {name: Origin((f"observation.{name}",), explicit=False) for name in default_origins()}
        once = {name: Origin((name,), explicit=False) for name in ONCE if name in self._log}
        time = "observation.time" if "observation.time" in self._names else "timestamp"
        return {**lerobot, **once, "time": Origin((time,), explicit=False)}

    def _episode(self) -> NDArray[np.bool_] | slice:
        """The rows of the episode that is asked for, or of the only one."""
        chosen = self.mapping.episode
        if EPISODE not in self._names:
            if chosen is not None:
                raise InvalidInput("episode", chosen, f"a table with a column {EPISODE}")
            return slice(None)
        episodes = self._read("episode", EPISODE)
        if episodes.ndim != 1:
            raise InvalidInput("episode", f"a column {EPISODE} of lists", "one number a row")
        present = np.unique(episodes)
        if chosen is None and len(present) == 1:
            return slice(None)
        if chosen is None or chosen not in present:
            allowed = ", ".join(str(each) for each in present[:20]) + (", …" if len(present) > 20 else "")
            raise InvalidInput("episode", "missing" if chosen is None else chosen, f"one of {allowed}")
        return self._only_groups_of(episodes == chosen)

    def _only_groups_of(self, rows: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Leave row groups without any of these rows unread; the rows within the others."""
        lengths = [self._file.metadata.row_group(group).num_rows for group in self._groups]
        parts = np.split(rows, np.cumsum(lengths)[:-1])
        self._groups = [group for group, part in enumerate(parts) if part.any()]
        return np.concatenate([parts[group] for group in self._groups])

    def _read(self, name: str, field: str) -> NDArray[Any]:
        parts: list[NDArray[Any]] = []
        for batch in self._file.iter_batches(1024, row_groups=self._groups, columns=[field], use_threads=False):
            if (times := batch.schema.names.count(field)) > 1:
                raise InvalidInput(name, f"column {field}, which stands {times} times", "each column once")
            if times == 0:
                raise InvalidInput(name, f"column {field}, damaged", "a column of this name")
            self._bytes += batch.nbytes
            if self._bytes > MAX_CONTENT_BYTES:
                raise InvalidInput("file", f"more than {MAX_CONTENT_BYTES} bytes", f"at most {MAX_CONTENT_BYTES}")
            parts.append(_dense(name, batch.column(field), 1024 * len(parts)))
        if not parts:
            raise InvalidInput(name, "without rows", "at least 2 frames")
        if len({part.shape[1:] for part in parts}) > 1:
            raise InvalidInput(name, "of rows of different lengths", "lists of one length")
        return np.concatenate(parts)


def _dense(name: str, column: pa.Array, first_row: int) -> NDArray[Any]:
    """Rows of nested lists as an array; raises ``InvalidInput`` naming the row where they are not of one length."""
    shape = [len(column)]
    while True:
        column = column.storage if isinstance(column, pa.ExtensionArray) else column
        if not any(is_kind(column.type) for is_kind in _LISTS):
            break
        if column.null_count:
            raise InvalidInput(name, f"null in the rows from {first_row} on", "a list in each row")
        lengths = np.asarray(column.value_lengths())
        if len(lengths) and (lengths != lengths[0]).any():
            row = first_row + int(np.flatnonzero(lengths != lengths[0])[0]) * shape[0] // len(lengths)
            raise InvalidInput(name, f"a list of another length at row {row}", f"{lengths[0]} entries, as at first")
        shape.append(int(lengths[0]) if len(lengths) else 0)
        column = column.flatten()
    if pa.types.is_string(column.type) or pa.types.is_large_string(column.type):
        return np.array(column.to_pylist()).reshape(shape)
    if not any(is_kind(column.type) for is_kind in _VALUES):
        raise InvalidInput(name, f"of type {column.type}"[:100], "numbers, truth values or moments, in lists or not")
    return np.asarray(column.to_numpy(zero_copy_only=False)).reshape(shape)


def _check_footer(path: Path) -> None:
    size = path.stat().st_size
    with path.open("rb") as stream:
        stream.seek(max(size - 8, 0))
        end = stream.read()
    length = int.from_bytes(end[:4], "little")
    if len(end) != 8 or end[4:] != b"PAR1" or length > min(size, MAX_FOOTER_BYTES):
        raise InvalidInput("file", f"a truncated or damaged Parquet ({size} bytes)", "a complete Parquet file")


@contextmanager
def _library() -> Iterator[None]:
    """Answer for a library that meets damaged files with whatever its parts raise."""
    try:
        yield
    except InvalidInput:
        raise
    except pa.ArrowMemoryError as error:  # what a page claims to unpack to is known to the library alone
        raise InvalidInput("file", f"in need of too much memory ({str(error)[:80]})", "an undamaged file") from error
    except MemoryError:
        raise
    except (pa.ArrowException, OSError, ValueError, KeyError, TypeError, OverflowError) as error:
        detail = f"{type(error).__name__}: {error}"[:120]
        raise InvalidInput("file", f"a truncated or damaged Parquet ({detail})", "a complete Parquet file") from error
