"""Headers of SQLite files, by their numbers alone."""

import itertools
import sqlite3
import struct
import zlib
from contextlib import closing
from pathlib import Path

import pytest

from db.file_header import PAGE_BYTES, FileHeader, after, is_older, renew

HEADER = FileHeader(generation=7, signature=0x12340005, schema=3, free_pages=2)


def follower(header: FileHeader, mark: int) -> FileHeader:
    """What a transaction that found ``header`` writes, by hand."""
    numbers = (header.generation, header.signature, header.schema, header.free_pages)
    checksum = zlib.crc32(struct.pack(">4i", *numbers)) % 2**16
    (signature,) = struct.unpack(">i", struct.pack(">HH", checksum, mark))
    return FileHeader(header.generation + 1, signature, header.schema, header.free_pages)


def test_the_fields_stand_where_sqlite_has_them_on_page_1() -> None:
    page = bytearray(PAGE_BYTES)
    for place, number in [(36, 2), (40, 3), (60, 7), (68, 0x12340005)]:
        struct.pack_into(">i", page, place, number)
    assert PAGE_BYTES == 72
    assert FileHeader.of_page(bytes(page)) == HEADER


def test_a_connection_tells_what_stands_in_the_file(tmp_path: Path) -> None:
    path = tmp_path / "file.sqlite3"
    with closing(sqlite3.connect(path)) as connection:
        connection.executescript("CREATE TABLE a (b); PRAGMA user_version = -5; PRAGMA application_id = -2147483648")
        told = FileHeader.of_connection(connection)
    assert told == FileHeader.of_page(path.read_bytes()[:PAGE_BYTES])
    assert (told.generation, told.signature, told.schema, told.free_pages) == (-5, -(2**31), 1, 0)


@pytest.mark.parametrize(("signature", "mark"), [(0x12340005, 5), (-1, 0xFFFF), (0x7FFF0000, 0), (-(2**31), 0)])
def test_the_mark_is_the_lower_half_of_the_signature(signature: int, mark: int) -> None:
    assert FileHeader(1, signature, 1, 0).mark == mark


@pytest.mark.parametrize("mark", [1, 0x7FFF, 0xFFFF])
def test_a_header_follows_the_one_whose_checksum_it_holds(mark: int) -> None:
    assert follower(HEADER, mark).follows(HEADER)
    assert not HEADER.follows(follower(HEADER, mark))


@pytest.mark.parametrize(
    "other",
    [
        FileHeader(8, 0x12340005, 3, 2),
        FileHeader(7, 0x12340006, 3, 2),
        FileHeader(7, 0x12340005, 4, 2),
        FileHeader(7, 0x12340005, 3, 1),
    ],
)
def test_whatever_differs_before_it_follows_another(other: FileHeader) -> None:
    assert not follower(HEADER, 9).follows(other)


def test_what_an_unmarked_program_wrote_follows_by_the_mark_that_it_left() -> None:
    assert FileHeader(8, HEADER.signature, 4, 0).follows(HEADER)
    assert FileHeader(8, 0x77770005, 3, 2).follows(HEADER)


def test_a_transaction_renews_the_header_so_that_it_follows(tmp_path: Path) -> None:
    with closing(sqlite3.connect(tmp_path / "file.sqlite3")) as connection:
        connection.execute("CREATE TABLE a (b)")
        seen = [FileHeader.of_connection(connection)]
        for _ in range(20):
            renew(connection)
            seen.append(FileHeader.of_connection(connection))
    assert [header.generation for header in seen] == list(range(21))
    assert all(later.follows(earlier) for earlier, later in itertools.pairwise(seen))
    assert all(header.mark != 0 for header in seen[1:])
    assert len({header.mark for header in seen[1:]}) > 10


@pytest.mark.parametrize(
    ("generation", "other", "older"),
    [
        (4, 5, True),
        (5, 4, False),
        (-1, 0, True),
        (0, 2**31 - 1, True),
        (0, -(2**31), False),
        (2**31 - 1, -(2**31), True),
        (-(2**31), 2**31 - 1, False),
    ],
)
def test_who_is_less_than_half_a_cycle_behind_is_older(generation: int, other: int, older: bool) -> None:
    assert is_older(generation, other) is older


def test_a_generation_is_older_than_the_next_all_around_the_cycle() -> None:
    for generation in (-(2**31), -2, -1, 0, 2**31 - 2, 2**31 - 1):
        assert is_older(generation, after(generation))
        assert not is_older(after(generation), generation)
