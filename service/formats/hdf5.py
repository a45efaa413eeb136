"""HDF5 files: one dataset or attribute a field (docs/formats.md)."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from service.formats import mapping as mappings
from service.formats.assemble import MAX_CONTENT_BYTES, assemble
from service.formats.mapping import FieldMapping, default_origins
from slipcore.errors import InvalidInput
from slipcore.frames import GraspLog

MAPPING_ATTRIBUTE = "stiction_mapping"
"""Attribute of the file that may hold the mapping."""

MAX_CHUNK_BYTES = 64 * 2**20
"""Bytes of one chunk of a dataset: the library takes them at once, whatever is asked of it."""

FILTERS = {h5py.h5z.FILTER_DEFLATE, h5py.h5z.FILTER_SHUFFLE, h5py.h5z.FILTER_FLETCHER32, h5py.h5z.FILTER_LZF}


def read(path: Path, mapping: FieldMapping | None = None) -> GraspLog:
    """Read a grasp log from an HDF5 file. Raises ``InvalidInput`` naming the member or dataset that is wrong."""
    with _library(), h5py.File(path, "r") as file:
        chosen = mappings.chosen_over(mapping, _own_mapping(file)).over(default_origins())
        return assemble(_Datasets(file), chosen)


class _Datasets:
    """The datasets of a file, and its attributes; a ``Recording``."""

    def __init__(self, file: h5py.File) -> None:
        self._file = file
        self._bytes = 0

    def column(self, name: str, _topic: str | None, field: str, _once: bool) -> NDArray[Any] | None:
        """A dataset by its path, or ``path@name`` for an attribute; None where it isn't there."""
        path, at, attribute = field.partition("@")
        found = _walk(self._file, path)
        if at or (found is None and "/" not in field and field in self._file.attrs):
            return _attribute(found if at else self._file, attribute or field)
        if found is None:
            return None
        if not isinstance(found, h5py.Dataset):
            raise InvalidInput(name, f"a group ({field})", "a dataset")
        self._check(name, found)
        return _plain(name, found[()])

    def grid(self) -> None:
        """Given by the arrays' shapes alone."""

    def contents(self) -> str:
        """The file's first datasets and groups."""
        return f"the datasets and groups {', '.join(list(self._file)[:20])}"[:300]

    def _check(self, name: str, dataset: h5py.Dataset) -> None:
        """Bound what is claimed before it is read, and let no file point at another."""
        self._bytes += dataset.nbytes
        if self._bytes > MAX_CONTENT_BYTES:
            raise InvalidInput(name, f"{dataset.nbytes} bytes by its header", f"at most {MAX_CONTENT_BYTES} in all")
        if dataset.external or dataset.is_virtual:
            raise InvalidInput(name, "kept in another file", "a dataset in this file")
        chunk = int(np.prod(dataset.chunks or (1,), dtype=object)) * dataset.dtype.itemsize
        if chunk > MAX_CHUNK_BYTES:
            raise InvalidInput(name, f"in chunks of {chunk} bytes", f"at most {MAX_CHUNK_BYTES}")
        pipeline = dataset.id.get_create_plist()
        filters = {pipeline.get_filter(number)[0] for number in range(pipeline.get_nfilters())}
        if filters - FILTERS:
            raise InvalidInput(name, f"packed by filter {min(filters - FILTERS)}", "gzip, lzf, shuffle, fletcher32")


def _own_mapping(file: h5py.File) -> FieldMapping:
    text = _attribute(file, MAPPING_ATTRIBUTE)
    return mappings.UNMAPPED if text is None else mappings.parse(str(text))


def _walk(group: Any, path: str) -> Any:
    """What a path leads to, never through a link into another file."""
    for part in (part for part in path.split("/") if part):
        if not isinstance(group, h5py.Group) or part not in group:
            return None
        link = group.get(part, getlink=True)
        if not isinstance(link, h5py.HardLink):
            raise InvalidInput(path, f"a {type(link).__name__}", "a dataset in this file, not a link")
        group = group[part]
    return group


def _attribute(owner: Any, name: str) -> NDArray[Any] | None:
    if owner is None or name not in owner.attrs:
        return None
    kept = owner.attrs.get_id(name)
    if kept.get_storage_size() > mappings.MAX_MAPPING_BYTES:
        raise InvalidInput(name, f"{kept.get_storage_size()} bytes", f"at most {mappings.MAX_MAPPING_BYTES}")
    return _plain(name, owner.attrs[name])


def _plain(name: str, value: Any) -> NDArray[Any]:
    """An array of numbers, truth values or text."""
    if isinstance(value, bytes):
        value = value.decode("utf-8", "replace")
    array = np.asarray(value)
    if array.dtype.kind not in "biufU":
        raise InvalidInput(name, f"of dtype {array.dtype}", "numbers, truth values or one text")
    return array


@contextmanager
def _library() -> Iterator[None]:
    """Answer for a library that meets damaged files with whatever its parts raise."""
    try:
        yield
    except (InvalidInput, MemoryError):
        raise
    except (OSError, RuntimeError, ValueError, KeyError, TypeError, OverflowError, SystemError) as error:
        detail = f"{type(error).__name__}: {error}"[:120]
        raise InvalidInput("file", f"a truncated or damaged HDF5 ({detail})", "a complete HDF5 file") from error
