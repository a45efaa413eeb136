"""What an SQLite write-ahead log says of the file that it belongs to, without SQLite, which would write it there.

The format is SQLite's own (https://sqlite.org/fileformat2.html, section 4).
"""

import struct
from pathlib import Path

_HEADER, _FRAME, _GENERATION = struct.Struct(">8I"), struct.Struct(">6I"), struct.Struct(">60xi")
"""Of the log, of each frame before its page, and of the database in page 1, which tells ``PRAGMA user_version``."""

_LARGEST_PAGE = 65536
"""Bytes; does not fit into the field, which then says 1."""


def first_generation(log: Path) -> int | None:
    """The generation in the first header of the database that the ``log`` holds; None where it holds none."""
    try:
        stream = log.open("rb")
    except OSError:
        return None
    with stream:
        head = stream.read(_HEADER.size)
        if len(head) < _HEADER.size:
            return None
        _, _, told_size, _, *salts = _HEADER.unpack(head)[:6]
        page_size = _LARGEST_PAGE if told_size == 1 else told_size
        while len(frame := stream.read(_FRAME.size)) == _FRAME.size:
            number, _, *own_salts = _FRAME.unpack(frame)[:4]
            if own_salts != salts:  # left over from before the log began anew
                return None
            if number == 1:
                page = stream.read(_GENERATION.size)
                stream.seek(0)
                is_whole = len(page) == _GENERATION.size and stream.read(_HEADER.size) == head
                return int(_GENERATION.unpack(page)[0]) if is_whole else None  # somebody may just begin it anew
            stream.seek(page_size, 1)
    return None
