"""A zip of .npy members, read in memory within bounds; nothing is ever extracted to disk."""

import errno
import lzma
import os
import struct
import zipfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from service.formats.npy import MAX_ARRAY_BYTES, read_array
from slipcore.errors import InvalidInput

MAX_DIRECTORY_BYTES = 64 * 1024
"""Bytes of the zip's own table of contents: about 1,000 members, where a log has 20."""

_DAMAGE = (zipfile.BadZipFile, zlib.error, lzma.LZMAError, EOFError, NotImplementedError, RuntimeError, ValueError)
_MEMBER = b"PK\x03\x04"
_END_OF_DIRECTORY, _ZIP64_LOCATOR, _END_BYTES, _LOCATOR_BYTES = b"PK\x05\x06", b"PK\x06\x07", 22, 20
_ELSEWHERE = 2**32 - 1
"""In place of a number that zip64 has; zip -fz writes it into a pipe, and no zip64 that has it."""
_ENCRYPTED = 0x1
_LOCAL_BYTES, _LOCAL_LENGTHS = 30, 26
"""Bytes of the header before a member, and where in it the lengths of its name and extra field are."""
_IS_DESCRIBED, _DESCRIPTOR_BYTES = 0x8, (12, 16, 20, 24)
"""A member that was written as a stream is followed by its lengths, in one of these numbers of bytes."""


@contextmanager
def open_archive(path: Path) -> Iterator[zipfile.ZipFile]:
    """Open a zip whose members are few, plainly named and bounded in size. Raises ``InvalidInput``."""
    _check_directory(path)
    with _sound():
        archive = zipfile.ZipFile(path)
    with archive:
        _check_members(archive)
        with _sound():
            _check_gaps(archive)
        yield archive


def unpacked_bytes(path: Path) -> int:
    """Bytes of a zip's members by its table of contents, which nothing is read beyond, or of any other file itself.

    Raises ``InvalidInput`` for a zip that is none, or none that is taken.
    """
    with path.open("rb") as stream:
        is_zip = stream.read(len(_MEMBER)) == _MEMBER
    if not is_zip:
        return path.stat().st_size
    with open_archive(path) as archive:
        return sum(entry.file_size for entry in archive.infolist())


def read_member(archive: zipfile.ZipFile, member: str, name: str) -> NDArray[Any]:
    """Read one .npy member as an array; errors call it ``name``."""
    with _sound():
        entry = archive.getinfo(member)
        with archive.open(entry) as stream:  # checks the member's own header
            if entry.compress_type != zipfile.ZIP_STORED:
                return read_array(stream, name, entry.file_size)
        stored = _Stored(archive, entry)
        array = read_array(stored, name, entry.file_size)
        stored.check()
        return array


class _Stored:
    """A member without compression, as a stream: ``zipfile`` reads it in pieces, three times as slowly."""

    def __init__(self, archive: zipfile.ZipFile, entry: zipfile.ZipInfo) -> None:
        assert archive.fp is not None
        self._file, self._entry, self._read, self._crc = archive.fp, entry, 0, 0
        if entry.file_size > os.fstat(self._file.fileno()).st_size:
            raise zipfile.BadZipFile(f"{entry.file_size} bytes in {entry.filename!r} by its header")
        self._file.seek(_content_offset(archive, entry))

    def read(self, size: int = -1, /) -> bytes:
        """The next bytes, fewer at the member's end."""
        left = self._entry.file_size - self._read
        content = self._file.read(left if size < 0 else min(size, left))
        self._read, self._crc = self._read + len(content), zlib.crc32(content, self._crc)
        return content

    def tell(self) -> int:
        """Bytes that were read."""
        return self._read

    def check(self) -> None:
        """Raises ``BadZipFile`` unless what was read is what was written."""
        if self._crc != self._entry.CRC:
            raise zipfile.BadZipFile(f"Bad CRC-32 for file {self._entry.filename!r}")


def _content_offset(archive: zipfile.ZipFile, entry: zipfile.ZipInfo) -> int:
    """Where in the file a member's content begins, by the header before it."""
    assert archive.fp is not None
    archive.fp.seek(entry.header_offset + _LOCAL_LENGTHS)
    lengths = archive.fp.read(4)
    if len(lengths) < 4:
        raise zipfile.BadZipFile(f"no header of {entry.filename!r} where it should be")
    name, extra = struct.unpack("<HH", lengths)
    return int(entry.header_offset + _LOCAL_BYTES + name + extra)


@contextmanager
def _sound() -> Iterator[None]:
    """Answer for ``zipfile``, which meets damage with whatever its parts raise."""
    try:
        yield
    except InvalidInput:
        raise
    except _DAMAGE as error:
        raise _damaged(error) from error
    except OSError as error:
        if error.errno != errno.EINVAL:  # a place in the file that cannot be
            raise
        raise _damaged(error) from error


def _check_directory(path: Path) -> None:
    """Bound the table of contents before ``zipfile`` turns each of its entries into an object.

    What stands before the first member, which ``zipfile`` passes over, is refused: to others the file is no zip. So is
    what stands behind the end but for zeros, with which some writers fill a block, and of two zips in one file the
    first, of which nothing would be read.
    """
    with path.open("rb") as stream:
        start, length = stream.read(len(_MEMBER)), stream.seek(0, 2)
        stream.seek(max(0, length - _END_BYTES - _LOCATOR_BYTES - 2**16))  # a comment may follow, of up to 2¹⁶ bytes
        tail = stream.read()
    end = tail.rfind(_END_OF_DIRECTORY)
    if end < 0 or len(tail) < end + _END_BYTES:
        raise InvalidInput("file", f"not a complete zip ({length} bytes, no table of contents)", "a complete zip")
    if start not in {_MEMBER, _END_OF_DIRECTORY}:
        raise InvalidInput("file", f"a zip behind other bytes (it starts with {start!r})", "nothing before a zip")
    size, offset, comment = struct.unpack_from("<IIH", tail, end + 12)
    zip64 = tail[max(0, end - _LOCATOR_BYTES) : end].startswith(_ZIP64_LOCATOR) or _ELSEWHERE in (size, offset)
    if zip64 or size > MAX_DIRECTORY_BYTES:
        value = "in the zip64 layout" if zip64 else f"{size} bytes"
        allowed = f"at most {MAX_DIRECTORY_BYTES} bytes, no zip64 (zip without -fz)"
        raise InvalidInput("table of contents", value, allowed)
    behind, before = len(tail[end + _END_BYTES + comment :].rstrip(b"\0")), length - len(tail) + end - (offset + size)
    if behind > 0:
        raise InvalidInput("file", f"a zip with {behind} other bytes behind it", "nothing behind a zip")
    if before > 0:
        raise InvalidInput("file", f"a zip with {before} bytes that are no part of it", "one zip, and nothing else")


def _check_members(archive: zipfile.ZipFile) -> None:
    entries = archive.infolist()
    names = [entry.filename for entry in entries]
    for entry in entries:
        parts = entry.filename.rstrip("/").split("/")
        if "\\" in entry.orig_filename or any(part in {"", ".", ".."} or ":" in part for part in parts):
            raise InvalidInput("member name", repr(entry.orig_filename), "a plain relative path")
        if entry.flag_bits & _ENCRYPTED:
            raise InvalidInput(entry.filename, "encrypted", "a zip without a password")
        if entry.compress_type not in {zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED}:
            raise InvalidInput(entry.filename, f"compressed by method {entry.compress_type}", "stored or deflated")
    if len(set(names)) != len(names):
        twice = next(name for name in names if names.count(name) > 1)
        raise InvalidInput(twice, "in the zip twice", "each member once")
    total = sum(entry.file_size for entry in entries)
    if total > MAX_ARRAY_BYTES:
        raise InvalidInput("file", f"{total} bytes unpacked", f"at most {MAX_ARRAY_BYTES} bytes unpacked")


def _check_gaps(archive: zipfile.ZipFile) -> None:
    """Refuse bytes between members, of which nobody would read any, and members that share some."""
    entries = sorted(archive.infolist(), key=lambda entry: entry.header_offset)
    begins = [*(entry.header_offset for entry in entries), archive.start_dir]
    ends = [(0, 0), *((_content_offset(archive, entry) + entry.compress_size, entry.flag_bits) for entry in entries)]
    for begin, (end, flags) in zip(begins, ends, strict=True):
        if begin != end and not (flags & _IS_DESCRIBED and begin - end in _DESCRIPTOR_BYTES):
            value = f"a zip with {begin - end} bytes from {end} on that are no member's"
            raise InvalidInput(
                "file", value if begin > end else "a zip of members that overlap", "one member after another"
            )


def _damaged(error: Exception) -> InvalidInput:
    return InvalidInput("file", f"a truncated or damaged zip ({error})", "a complete zip")
