"""Write-ahead logs that are made here, byte by byte, as the file format has them."""

import struct
from collections.abc import Iterator
from pathlib import Path

import pytest

from db.file_header import FileHeader
from db.write_ahead_log import headers

SALTS = (0x01020304, 0x0A0B0C0D)
LITTLE, BIG = 0x377F0682, 0x377F0683
"""Beginnings of a log: which order of bytes its checksums go by."""


def checksum(magic: int, content: bytes, start: tuple[int, int]) -> tuple[int, int]:
    first, second = start
    for even, odd in struct.iter_unpack("<II" if magic == LITTLE else ">II", content):
        first = (first + even + second) % 2**32
        second = (second + odd + first) % 2**32
    return first, second


def page(size: int, generation: int) -> bytes:
    content = bytearray(b"\x11" * size)
    struct.pack_into(">i", content, 60, generation)
    return bytes(content)


def pieces(magic: int, size: int, frames: list[tuple[int, int]], told: int | None = None) -> Iterator[bytes]:
    """A log's head, then each frame of a page by its number and generation."""
    head = struct.pack(">6I", magic, 3007000, size if told is None else told, 0, *SALTS)
    sums = checksum(magic, head, (0, 0))
    yield head + struct.pack(">2I", *sums)
    for number, generation in frames:
        begin, content = struct.pack(">2I", number, 0), page(size, generation)
        sums = checksum(magic, begin + content, sums)
        yield begin + struct.pack(">4I", *SALTS, *sums) + content


def generations(path: Path, content: bytes) -> list[int]:
    path.write_bytes(content)
    found = headers(path)
    assert all(header.schema == header.free_pages == 0x11111111 for header in found)
    return [header.generation for header in found]


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "database-wal"


@pytest.mark.parametrize("magic", [LITTLE, BIG])
@pytest.mark.parametrize("size", [512, 4096])
def test_each_page_1_tells_its_header_from_the_oldest_to_the_newest(path: Path, magic: int, size: int) -> None:
    content = b"".join(pieces(magic, size, [(2, -1), (1, 5), (7, -2), (1, 6), (1, 7)]))
    assert generations(path, content) == [5, 6, 7]


def test_a_page_of_65536_bytes_is_told_as_1(path: Path) -> None:
    assert generations(path, b"".join(pieces(LITTLE, 65536, [(1, 5), (1, 6)], told=1))) == [5, 6]


@pytest.mark.parametrize("magic", [LITTLE, BIG])
@pytest.mark.parametrize("place", [-1, -511, -400])
def test_a_first_page_that_is_not_whole_tells_nothing_and_a_later_one_is_not_looked_at(
    path: Path, magic: int, place: int
) -> None:
    content = bytearray(b"".join(pieces(magic, 512, [(1, 5)])))
    content[place] ^= 1
    assert generations(path, bytes(content)) == []
    later = bytearray(b"".join(pieces(magic, 512, [(1, 5), (1, 6)])))
    later[-1] ^= 1
    assert generations(path, bytes(later)) == [5, 6]


@pytest.mark.parametrize("salt", [32 + 8, 32 + 12])
def test_frames_of_before_the_log_began_anew_are_left_out(path: Path, salt: int) -> None:
    first, *frames = pieces(LITTLE, 512, [(1, 5), (1, 6), (1, 7)])
    stale = bytearray(frames[1])
    stale[salt - 32] ^= 1
    assert generations(path, b"".join([first, frames[0], bytes(stale), frames[2]])) == [5]


@pytest.mark.parametrize(("cut", "told"), [(1, [5, 6]), (440, [5, 6]), (441, [5]), (512 + 1, [5]), (512 + 24, [5])])
def test_of_a_page_that_ends_early_as_much_must_be_there_as_is_read(path: Path, cut: int, told: list[int]) -> None:
    content = b"".join(pieces(LITTLE, 512, [(1, 5), (1, 6)]))
    assert generations(path, content[:-cut]) == told


def test_of_the_first_page_all_must_be_there(path: Path) -> None:
    content = b"".join(pieces(LITTLE, 512, [(1, 5)]))
    assert generations(path, content[:-1]) == []
    assert generations(path, content[:-8]) == []


def test_a_log_without_page_1_or_frames_tells_none(path: Path) -> None:
    assert generations(path, b"".join(pieces(BIG, 512, []))) == []
    assert generations(path, b"".join(pieces(BIG, 512, [(2, 5), (3, 6)]))) == []


def test_all_four_numbers_are_read(path: Path) -> None:
    head, frame = pieces(LITTLE, 512, [(1, 5)])
    assert len(head + frame) == 32 + 24 + 512
    path.write_bytes(head + frame)
    assert headers(path) == [FileHeader(5, 0x11111111, 0x11111111, 0x11111111)]
