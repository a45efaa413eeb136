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
    """The first one only if its frame is whole: its page is written after its head, over one of an earlier log."""
    told_size = _HEAD.unpack(head)[2]
    page_size = _LARGEST_PAGE if told_size == 1 else told_size
    is_first = True
    for place, frame, checksum in _frames_of_page_1(file, head, page_size):
        page = os.pread(file, page_size if is_first else PAGE_BYTES, place)
        if len(page) < PAGE_BYTES or (is_first and not _is_whole(head, frame, page, checksum)):
            return
        is_first = False
        yield FileHeader.of_page(page[:PAGE_BYTES])


def _frames_of_page_1(file: int, head: bytes, page_size: int) -> Iterator[tuple[int, bytes, tuple[int, int]]]:
    """Where page 1 begins, the head of its frame, and the checksum that this one goes on from."""
    *_, salt, other_salt, first, second = _HEAD.unpack(head)
    place = _HEAD.size
    while len(frame := os.pread(file, _FRAME.size, place)) == _FRAME.size:
        number, _, *own_salts, next_first, next_second = _FRAME.unpack(frame)
        if own_salts != [salt, other_salt]:  # left over from before the log began anew
            return
        if number == 1:
            yield place + _FRAME.size, frame, (first, second)
        first, second = next_first, next_second
        place += _FRAME.size + page_size


def _is_whole(head: bytes, frame: bytes, page: bytes, checksum: tuple[int, int]) -> bool:
    """Whether a frame has the checksum that its head states, which goes on from that of the frame before."""
    covered = frame[:8] + page
    if len(covered) % 8:
        return False
    order = "><"[_HEAD.unpack(head)[0] % 2 == 0]
    words = struct.unpack(f"{order}{len(covered) // 4}I", covered)
    first, second = checksum
    for even, odd in zip(words[::2], words[1::2], strict=True):
        first = (first + even + second) % 2**32
        second = (second + odd + first) % 2**32
    return (first, second) == _FRAME.unpack(frame)[4:]
