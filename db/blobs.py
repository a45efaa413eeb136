"""Content-addressed files: a blob's name is the SHA-256 of its bytes, and it is there as a whole or not at all."""

import hashlib
import os
import re
import uuid
from collections.abc import Callable, Iterator
from itertools import islice
from pathlib import Path
from types import TracebackType
from typing import Self

from db.defaults import HASHES_PER_QUERY
from db.errors import NotFound, StorageUnavailable

_SHA256 = re.compile(r"[0-9a-f]{64}")


class Spool:
    """A file under way into the store: hashed while it is written, gone at the end unless kept."""

    def __init__(self, path: Path, place: Callable[[str], Path]) -> None:
        self.path = path
        self.size = 0
        self._place = place
        self._hash = hashlib.sha256()
        self._file = path.open("xb")

    def write(self, chunk: bytes) -> None:
        """Append a chunk; raises ``StorageUnavailable`` on a full or broken disk."""
        try:
            self._file.write(chunk)
        except OSError as error:
            raise StorageUnavailable(f"blob folder: {error}") from error
        self._hash.update(chunk)
        self.size += len(chunk)

    def flush(self) -> None:
        """Let readers of ``path`` see all that was written."""
        try:
            self._file.flush()
        except OSError as error:
            raise StorageUnavailable(f"blob folder: {error}") from error

    def sync(self) -> None:
        """Let what was written reach the disk, which ``keep`` then need not wait for."""
        try:
            self._file.flush()
            os.fsync(self._file.fileno())
        except OSError as error:
            raise StorageUnavailable(f"blob folder: {error}") from error

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
        try:
            target = self._place(self.sha256)
            _make_folder(target.parent)
            self.path.replace(target)  # atomic; a blob of that name has the same bytes
            _sync_folder(target.parent)
        except OSError as error:
            raise StorageUnavailable(f"blob folder: {error}") from error
        return self.sha256

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            self._file.close()  # what is still buffered may find the disk full once more
        except OSError as fault:
            raise StorageUnavailable(f"blob folder: {fault}") from fault
        finally:
            self.path.unlink(missing_ok=True)


class BlobStore:
    """A folder of blobs, ``blobs/ab/ab12…``, with the spool files under way beside them in ``spool``."""

    def __init__(self, folder: Path) -> None:
        self._blobs, self._spool = folder / "blobs", folder / "spool"
        for part in (self._blobs, self._spool):
            part.mkdir(parents=True, exist_ok=True)

    def spool(self) -> Spool:
        """A new file to write to; use it in a ``with`` statement."""
        try:
            return Spool(self._spool / uuid.uuid4().hex, self._place)
        except OSError as error:
            raise StorageUnavailable(f"blob folder: {error}") from error

    def put(self, content: bytes) -> str:
        """Store bytes and return their hash."""
        with self.spool() as spool:
            spool.write(content)
            return spool.keep()

    def path(self, sha256: str) -> Path:
        """The file that holds a blob; raises ``NotFound``."""
        path = self._place(sha256)
        if not path.is_file():
            raise NotFound("blob", sha256)
        return path

    def ping(self) -> None:
        """Make sure that the folder takes files; raises ``StorageUnavailable``."""
        with self.spool() as spool:
            spool.write(b"ready")
            spool.flush()

    def hashes(self) -> Iterator[str]:
        """Hashes of all blobs, in no order. Files that are not blobs are left out."""
        for path in self._blobs.glob("??/*"):
            if _SHA256.fullmatch(path.name):
                yield path.name

    def sweep(self, referenced: Callable[[list[str]], set[str]]) -> list[str]:
        """Remove spool files and the blobs that nothing refers to; returns the hashes removed.

        ``referenced`` tells which of some hashes are referred to. Only for when nobody writes: at start-up.
        """
        for path in self._spool.iterdir():
            path.unlink(missing_ok=True)
        removed: list[str] = []
        remaining = self.hashes()
        while some := list(islice(remaining, HASHES_PER_QUERY)):
            removed += sorted(set(some) - referenced(some))
        for sha256 in removed:
            self._place(sha256).unlink()
        return removed

    def _place(self, sha256: str) -> Path:
        if not _SHA256.fullmatch(sha256):
            raise NotFound("blob", sha256)
        return self._blobs / sha256[:2] / sha256


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
