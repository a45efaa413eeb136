"""What the header of an SQLite file says of which state of the database it is, and which one came before.

Each transaction renews two fields that SQLite (https://sqlite.org/fileformat2.html, section 1.3) leaves to its callers:
``user_version`` counts, and ``application_id`` holds a random mark and a checksum of the header before. A write-ahead
log whose first header follows another file's was made for that one, whatever the counts are.
"""

import random
import sqlite3
import struct
import zlib
from dataclasses import astuple, dataclass
from typing import Self

GENERATION = "PRAGMA user_version"
"""Counts the transactions."""

_SIGNATURE = "PRAGMA application_id"
"""The checksum of the header before, in the upper 16 bits, and the mark of this one."""

_FIELDS = (GENERATION, _SIGNATURE, "PRAGMA schema_version", "PRAGMA freelist_count")
"""The last two change with what other programs do that leaves the first two: VACUUM, another index, deleted rows."""

_IN_PAGE = struct.Struct(">36xii16xi4xi")
"""Where page 1 has them: free pages, schema, generation, signature."""

_CYCLE = 2**32
"""Generations after which the field of 32 bits begins anew."""

PAGE_BYTES = _IN_PAGE.size
"""Of page 1, as far as it is read."""

_RANDOM = random.SystemRandom()
"""Processes that were forked from one must not draw the same marks."""


@dataclass(frozen=True, slots=True)
class FileHeader:
    """Four signed numbers of 32 bits from the header of a database file or of page 1 in its write-ahead log."""

    generation: int
    signature: int
    schema: int
    free_pages: int

    @classmethod
    def of_connection(cls, connection: sqlite3.Connection) -> Self:
        """As the connection sees it; raises ``sqlite3.Error``."""
        return cls(*(connection.execute(field).fetchone()[0] for field in _FIELDS))

    @classmethod
    def of_page(cls, page: bytes) -> Self:
        """From the first ``PAGE_BYTES`` of page 1."""
        free_pages, schema, generation, signature = _IN_PAGE.unpack(page)
        return cls(generation, signature, schema, free_pages)

    @property
    def mark(self) -> int:
        """Drawn at random by the transaction that wrote it; 0 of what older versions and other programs made."""
        return self.signature & 0xFFFF

    def follows(self, other: Self) -> bool:
        """Whether the transaction that wrote this header found the ``other`` one; unmarked ones change no signature."""
        return self.signature >> 16 & 0xFFFF == other._checksum() or self.mark == other.mark

    def _checksum(self) -> int:
        return zlib.crc32(struct.pack(">4i", *astuple(self))) & 0xFFFF


def renew(connection: sqlite3.Connection) -> None:
    """Let the transaction that the connection has begun write a header of its own."""
    before = FileHeader.of_connection(connection)
    signature = before._checksum() << 16 | _RANDOM.randrange(1, 2**16)
    connection.execute(f"{GENERATION} = {after(before.generation)}")
    connection.execute(f"{_SIGNATURE} = {_signed(signature)}")


def after(generation: int) -> int:
    """The next one; beyond 2³¹ − 1 the field goes on at its other end."""
    return _signed(generation + 1)


def is_older(generation: int, other: int) -> bool:
    """By serial numbers (RFC 1982), of which the one that is less than half a cycle behind is older."""
    return (generation - other) % _CYCLE > _CYCLE // 2


def _signed(number: int) -> int:
    return (number + _CYCLE // 2) % _CYCLE - _CYCLE // 2
