"""Content-addressed files: a blob's name is the SHA-256 of its bytes, and it is there as a whole or not at all."""

import hashlib
import os
import re
import time
import uuid
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from itertools import islice
from pathlib import Path
from types import TracebackType
from typing import Self

from db.defaults import CACHE_GRACE, COPY_BYTES, HASHES_PER_QUERY, ORPHAN_AGE
from db.errors import NotFound, StorageUnavailable
from db.object_store import ObjectStore

_SHA256 = re.compile(r"[0-9a-f]{64}")


@contextmanager
def disk_errors_named() -> Iterator[None]:
    """Raise ``StorageUnavailable`` where the disk is full, broken or gone."""
    try:
        yield
    except OSError as error:
        raise StorageUnavailable(f"blob folder: {error}") from error


class Spool:
    """A file under way into the store: hashed while it is written, gone at the end unless kept."""

    def __init__(self, path: Path, take_in: Callable[[Path, str], None]) -> None:
        self.path = path
        self.size = 0
        self._take_in = take_in
        self._hash = hashlib.sha256()
        self._file = path.open("xb")

    def write(self, chunk: bytes | bytearray) -> None:
        """Append a chunk; raises ``StorageUnavailable`` on a full or broken disk."""
        with disk_errors_named():
            self._file.write(chunk)
        self._hash.update(chunk)
        self.size += len(chunk)

    def flush(self) -> None:
        """Let readers of ``path`` see all that was written."""
        with disk_errors_named():
            self._file.flush()

    def sync(self) -> None:
        """Let what was written reach the disk, which ``keep`` then need not wait for."""
        with disk_errors_named():
            self._file.flush()
            os.fsync(self._file.fileno())

    def adopt(self) -> None:
        """Take what another process wrote to ``path`` as what was written here."""
        with self.path.open("rb") as stream:
            self._hash = hashlib.file_digest(stream, hashlib.sha256)
            self.size = stream.tell()

    @property
    def sha256(self) -> str:
        """Hash of what was written so far."""
        return self._hash.hexdigest()

    def keep(self) -> str:
        """Make it a blob, durably (file, then name, then folder reach the disk), and return its hash."""
        self.sync()
        with disk_errors_named():
            self._take_in(self.path, self.sha256)
        return self.sha256

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            with disk_errors_named():
                self._file.close()  # what is still buffered may find the disk full once more
        finally:
            self.path.unlink(missing_ok=True)


class BlobStore:
    """A folder of blobs, ``blobs/ab/ab12…``, with the spool files under way beside them in ``spool``.

    With a ``remote`` the blobs are there, and the folder holds those that were used last, ``cache_bytes`` of them.
    """

    def __init__(self, folder: Path, remote: ObjectStore | None = None, cache_bytes: int = 0) -> None:
        self._blobs, self._spool = folder / "blobs", folder / "spool"
        self._remote, self._cache_bytes, self._fetched = remote, cache_bytes, cache_bytes
        for part in (self._blobs, self._spool):
            part.mkdir(parents=True, exist_ok=True)

    def spool(self) -> Spool:
        """A new file to write to; use it in a ``with`` statement."""
        with disk_errors_named():
            return Spool(self._spool / uuid.uuid4().hex, self._take_in)

    def put(self, content: bytes) -> str:
        """Store bytes and return their hash."""
        with self.spool() as spool:
            spool.write(content)
            return spool.keep()

    def take(self, file: Path, sha256: str) -> None:
        """Store a copy of a file that must have this hash; raises ``StorageUnavailable`` if it has another."""
        with self.spool() as spool:
            with file.open("rb") as stream:
                while chunk := stream.read(COPY_BYTES):
                    spool.write(chunk)
            if spool.sha256 != sha256:
                raise StorageUnavailable(f"{file} has other bytes than it had: its hash is {spool.sha256}")
            spool.keep()

    def path(self, sha256: str) -> Path:
        """The file that holds a blob, fetched where it has to be; raises ``NotFound``."""
        path = self._place(sha256)
        if path.is_file():
            if self._remote is not None:
                path.touch()  # the cache drops those that were not used for longest
            return path
        if self._remote is None:
            raise NotFound("blob", sha256)
        with self.spool() as spool:
            self._remote.get(sha256, spool.path)
            spool.adopt()
            if spool.sha256 != sha256:
                raise StorageUnavailable(f"blob store: {sha256} has other bytes than it had")
            _move(spool.path, path)
        self._make_room(path.stat().st_size)
        return path

    def has(self, sha256: str) -> bool:
        """Whether a blob is stored."""
        return self._place(sha256).is_file() if self._remote is None else self._remote.has(sha256)

    def is_intact(self, sha256: str) -> bool:
        """Whether a blob, read as a whole, has the bytes that it is named for."""
        with self.path(sha256).open("rb") as stream:
            return hashlib.file_digest(stream, hashlib.sha256).hexdigest() == sha256

    def remove(self, hashes: Iterable[str]) -> None:
        """Delete blobs to which nothing refers; those that aren't there are no error."""
        gone = list(hashes)
        if self._remote is not None:
            self._remote.delete(gone)
        for sha256 in gone:
            self._place(sha256).unlink(missing_ok=True)

    def ping(self) -> None:
        """Make sure that the folder takes files, and the remote answers; raises ``StorageUnavailable``."""
        with self.spool() as spool:
            spool.write(b"ready")
            spool.flush()
        if self._remote is not None:
            self._remote.ping()

    def hashes(self) -> Iterator[str]:
        """Hashes of all blobs, in no order. Files that are not blobs are left out."""
        return self._local() if self._remote is None else self._remote.hashes()

    def sweep(self, referenced: Callable[[list[str]], set[str]]) -> list[str]:
        """Remove spool files and the blobs that nothing refers to; returns the hashes removed.

        ``referenced`` tells which of some hashes are referred to. Only for when nobody writes to the folder: at
        start-up. Of a remote, to which others may write, only objects of some age are removed.
        """
        for path in self._spool.iterdir():
            path.unlink(missing_ok=True)
        removed: list[str] = []
        remaining = self._local() if self._remote is None else self._remote.hashes(self._remote.now() - ORPHAN_AGE)
        while some := list(islice(remaining, HASHES_PER_QUERY)):
            removed += sorted(set(some) - referenced(some))
        self.remove(removed)
        return removed

    def _take_in(self, spooled: Path, sha256: str) -> None:
        """Make a spooled file, which is on the disk already, a blob."""
        if self._remote is not None:
            self._remote.put(sha256, spooled)
        size = spooled.stat().st_size
        _move(spooled, self._place(sha256))
        if self._remote is not None:
            self._make_room(size)

    def _make_room(self, size: int) -> None:
        """Drop what was not used for longest once the cache may be over its size: looking takes a walk over it."""
        self._fetched += size
        if self._fetched * 10 < self._cache_bytes:
            return
        self._fetched = 0
        files = sorted((stat.st_mtime, stat.st_size, path) for path, stat in self._files())
        total = sum(size for _, size, _ in files)
        latest = min(time.time(), max((used for used, _, _ in files), default=0.0))  # clocks may be set ahead
        for used, size, path in files:
            if total <= self._cache_bytes or used > latest - CACHE_GRACE:
                return
            path.unlink(missing_ok=True)
            total -= size

    def _files(self) -> Iterator[tuple[Path, os.stat_result]]:
        for path in self._blobs.glob("??/*"):
            with suppress(FileNotFoundError):
                yield path, path.stat()

    def _local(self) -> Iterator[str]:
        for path in self._blobs.glob("??/*"):
            if _SHA256.fullmatch(path.name):
                yield path.name

    def _place(self, sha256: str) -> Path:
        if not _SHA256.fullmatch(sha256):
            raise NotFound("blob", sha256)
        return self._blobs / sha256[:2] / sha256


def open_blobs(folder: Path, url: str | None = None, cache_bytes: int = 0) -> BlobStore:
    """The blobs in a folder, or those of the object store at ``url`` with the folder as their cache."""
    return BlobStore(folder, None if url is None else ObjectStore(url), cache_bytes)


def _move(spooled: Path, target: Path) -> None:
    """Atomic and durable: file, then name, then folder reach the disk; a blob of that name has the same bytes."""
    _make_folder(target.parent)
    spooled.replace(target)
    _sync_folder(target.parent)


def _make_folder(folder: Path) -> None:
    if not folder.is_dir():
        folder.mkdir(exist_ok=True)
        _sync_folder(folder.parent)


def _sync_folder(folder: Path) -> None:
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
