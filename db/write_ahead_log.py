"""What an SQLite write-ahead log holds of a database's header, without SQLite, which would write it into the file.

The format is SQLite's own (https://sqlite.org/fileformat2.html, section 4).
"""

import os
import struct
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

from db.file_header import PAGE_BYTES, FileHeader

_HEAD, _FRAME = struct.Struct(">8I"), struct.Struct(">6I")
"""Of the log, and of each frame before its page."""

_LARGEST_PAGE = 65536
"""Bytes; does not fit into the field, which then says 1."""


def headers(log: Path) -> list[FileHeader]:
    """The database's headers in the ``log``, from the oldest to the newest; none where it holds none.

    Those at its end may be of a transaction that was never committed, and are in no file then.
    """
    with suppress(OSError), log.open("rb", buffering=0) as stream:
        head = stream.read(_HEAD.size)
        found = list(_headers(stream.fileno(), head)) if len(head) == _HEAD.size else []
        return found if os.pread(stream.fileno(), _HEAD.size, 0) == head else []  # somebody has just begun it anew
    return []


def _headers(file: int, head: bytes) -> Iterator[FileHeader]:
    _, _, told_size, _, *salts = _HEAD.unpack(head)[:6]
    page_size = _LARGEST_PAGE if told_size == 1 else told_size
    place = _HEAD.size
    while len(frame := os.pread(file, _FRAME.size, place)) == _FRAME.size:
        number, _, *own_salts = _FRAME.unpack(frame)[:4]
        if own_salts != salts:  # left over from before the log began anew
            return
        if number == 1:
            page = os.pread(file, page_size, place + _FRAME.size)
            if len(page) < max(page_size, PAGE_BYTES) or (place == _HEAD.size and not _is_whole(head, frame, page)):
                return
            yield FileHeader.of_page(page[:PAGE_BYTES])
        place += _FRAME.size + page_size


def _is_whole(head: bytes, frame: bytes, page: bytes) -> bool:
    """Whether the first frame has its checksum: its page is written after it, over one of before."""
    magic, *_, first, second = _HEAD.unpack(head)
    order = "><"[magic % 2 == 0]
    covered = frame[:8] + page
    words = struct.unpack(f"{order}{len(covered) // 4}I", covered)
    for even, odd in zip(words[::2], words[1::2], strict=True):
        first = (first + even + second) % 2**32
        second = (second + odd + first) % 2**32
    return [first, second] == list(_FRAME.unpack(frame)[4:])
