"""Content-addressed files: a blob's name is the SHA-256 of its bytes, and it is there as a whole or not at all."""

import fcntl
import hashlib
import math
import os
import re
import shutil
import time
import uuid
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from datetime import UTC, datetime
from pathlib import Path
from tempfile import TemporaryFile, mkdtemp
from types import TracebackType
from typing import IO, Self

from db.defaults import CACHE_GRACE, COPY_BYTES
from db.errors import BlobDamaged, NotFound, StorageUnavailable
from db.object_store import ObjectQuarantine, ObjectStore
from db.quarantine import FolderQuarantine, Quarantine, move, sync_folder

_SHA256 = re.compile(r"[0-9a-f]{64}")
FOLDERS = ("blobs", "spool")
"""That a store makes in its folder."""

STORE_ID = "store-id"
"""File beside the blobs that says which store they belong to (``db.identity``)."""

MOST_CHECKED = 10_000
"""Blobs of which it is remembered when they were read last; when there are more, all are forgotten."""

UNSETTLED = "first start of "
"""What that file begins with until the database has the id, too."""


@contextmanager
def disk_errors_named() -> Iterator[None]:
    """Raise ``StorageUnavailable`` where the disk is full, broken or gone."""
    try:
        yield
    except OSError as error:
        raise StorageUnavailable(f"blob folder: {error}") from error


class Spool:
    """A file under way into the store: hashed while it is written, gone at the end unless kept.

    Until then its process holds it, by a lock that ends with the process, however that ends.
    """

    def __init__(self, path: Path, take_in: Callable[[Path, str], None]) -> None:
        self.path = path
        self.size = 0
        self._take_in = take_in
        self._hash = hashlib.sha256()
        self._file = path.open("x+b")
        with suppress(OSError):  # where the file system has no locks, nobody else gets one either
            fcntl.flock(self._file, fcntl.LOCK_SH | fcntl.LOCK_NB)  # shared, for HDF5 locks what it reads

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
        with disk_errors_named(), self.path.open("rb") as stream:
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
            with suppress(OSError):  # what is stored is stored; a start clears what could not be removed
                self.path.unlink(missing_ok=True)


class BlobStore:
    """A folder of blobs, ``blobs/ab/ab12…``, with the spool files under way beside them in ``spool``.

    With a ``remote`` the blobs are there, and the folder holds those that were used last, ``cache_bytes`` of them.
    Blobs to which nothing refers are set aside in ``quarantine``, from where a reader still gets them.
    """

    def __init__(self, folder: Path, remote: ObjectStore | None = None, cache_bytes: int = 0) -> None:
        self._blobs, self._spool, self._set_aside = (folder / part for part in ("blobs", "spool", "quarantine"))
        self._remote, self._cache_bytes, self._fetched = remote, cache_bytes, cache_bytes
        self.quarantine: Quarantine = (
            FolderQuarantine(self._set_aside, self._place) if remote is None else ObjectQuarantine(remote)
        )
        self._checked: dict[str, tuple[float, tuple[int, ...]]] = {}  # when, and as which file
        self.store_id: str | None = None  # that of the database that works with it, once somebody has compared them
        for part in FOLDERS:
            (folder / part).mkdir(parents=True, exist_ok=True)

    def __str__(self) -> str:
        return f"blob folder {self._blobs}" if self._remote is None else f"blob store {self._remote}"

    @property
    def disk(self) -> Path:
        """A folder on the disk that takes what comes in."""
        return self._spool

    @property
    def is_remote(self) -> bool:
        """Whether the blobs are in an object store."""
        return self._remote is not None

    def has_within(self, folder: Path) -> bool:
        """Whether a folder is among the store's own files, or its blobs are the store's or have these among them.

        By whichever way: a link, or another mount.
        """
        own, theirs = (self._blobs, self._spool, self._set_aside), folder / self._blobs.name
        parts = {_identity(part) for part in own}
        among = any(not parts.isdisjoint(_way_to(place)) for place in (folder, theirs))
        return among or any(_identity(theirs) in _way_to(part) for part in own)

    def is_within(self, folder: Path) -> bool:
        """Whether any of the store's own files are in a folder, by whichever way."""
        return any(_identity(folder) in _way_to(part) for part in (self._blobs, self._spool, self._set_aside))

    def spool(self) -> Spool:
        """A new file to write to; use it in a ``with`` statement."""
        with disk_errors_named():
            return Spool(self._spool / uuid.uuid4().hex, self._take_in)

    def unnamed_file(self) -> IO[bytes]:
        """A new file beside those of ``spool``, without a name: it is gone once it is closed or its process ends."""
        with disk_errors_named():
            return TemporaryFile(dir=self._spool)

    def folder(self) -> Path:
        """A new folder beside the files of ``spool``; who asks for it removes it."""
        with disk_errors_named():
            return Path(mkdtemp(dir=self._spool))

    def under_way(self) -> list[Path]:
        """The files of ``spool`` and the folders beside them, also those that killed processes have left."""
        with disk_errors_named():
            return list(self._spool.iterdir())

    def clear_spool(self) -> None:
        """Remove what was under way when its process ended; only for one who works in the folder alone.

        What a command beside it holds, as of a restore, stays.
        """
        for path in self.under_way():
            self.remove_unheld(path)

    def remove_unheld(self, path: Path) -> bool:
        """Remove one of those unless a process holds it as its ``Spool``; whether it did. Nobody holds a folder."""
        try:
            if path.is_dir():
                _remove(path)
                return True
            with path.open("r+b") as file:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
                _remove(path)
        except OSError:  # held, gone, or where there are no locks
            return False
        return True

    def put(self, content: bytes) -> str:
        """Store bytes and return their hash."""
        with self.spool() as spool:
            spool.write(content)
            return spool.keep()

    def take(self, file: Path, sha256: str) -> None:
        """Store a copy of a file that must have this hash; raises ``BlobDamaged`` if it has another."""
        with self.spool() as spool:
            with disk_errors_named(), file.open("rb") as stream:
                while chunk := stream.read(COPY_BYTES):
                    spool.write(chunk)
            if spool.sha256 != sha256:
                raise BlobDamaged(sha256, spool.sha256)
            spool.keep()

    def path(self, sha256: str, checked_within: float = 0.0) -> Path:
        """The file that holds a blob, with the bytes that it is named for: they are read and compared each time.

        Not those that were read ``checked_within`` so many seconds, of a file that nobody has written to since. Raises
        ``NotFound``, and ``BlobDamaged``.
        """
        if self._is_checked(sha256, checked_within):
            return self._place(sha256)
        path = self.locate(sha256)
        checked = time.monotonic(), _state(path)
        found = _hash(path)
        if found != sha256 and self._remote is not None:  # the cache's copy
            path.unlink(missing_ok=True)
            path = self.locate(sha256)
            checked = time.monotonic(), _state(path)
            found = _hash(path)
        if found != sha256:
            raise BlobDamaged(sha256, found)
        if len(self._checked) >= MOST_CHECKED:
            self._checked.clear()
        self._checked[sha256] = checked
        return path

    def _is_checked(self, sha256: str, within: float) -> bool:
        at, state = self._checked.get(sha256, (-math.inf, None))
        if time.monotonic() - at >= within:
            return False
        try:
            return _state(self._place(sha256)) == state
        except StorageUnavailable:  # it is not there any more
            return False

    def locate(self, sha256: str) -> Path:
        """The file that holds a blob, for one who compares its bytes with the hash; raises ``NotFound``."""
        path = self._place(sha256)
        if path.is_file():
            if self._remote is not None:
                path.touch()  # the cache drops those that were not used for longest
            return path
        if self._remote is None:
            if not self.quarantine.recall(sha256):
                self._require_own()
                raise NotFound("blob", sha256)
            return path
        return self._fetch(self._remote, sha256, path)

    def has(self, sha256: str) -> bool:
        """Whether a blob is stored."""
        return self._place(sha256).is_file() if self._remote is None else self._remote.has(sha256)

    def remove(self, hashes: Iterable[str]) -> None:
        """Delete blobs to which nothing refers; those that aren't there are no error."""
        gone = list(hashes)
        self._require_own()
        if self._remote is not None:
            self._remote.delete(gone)
        for sha256 in gone:
            self._place(sha256).unlink(missing_ok=True)

    def ping(self) -> None:
        """Make sure that the folder takes files and is still that of the store; raises ``StorageUnavailable``."""
        with self.spool() as spool:
            spool.write(b"ready")
            spool.flush()
        self._require_own()
        if self._remote is not None:
            self._remote.ping()

    def hashes(self, before: datetime | None = None) -> Iterator[str]:
        """Hashes of all blobs, or of those stored before a moment, in no order. What is no blob is left out."""
        return self._local(before) if self._remote is None else self._remote.hashes(before)

    def hashes_under(self, prefix: str) -> Iterator[str]:
        """Hashes of the blobs in the folder that begin with these two characters."""
        yield from (path.name for path in self._blobs.glob(f"{prefix}/*") if _SHA256.fullmatch(path.name))

    def now(self) -> datetime:
        """The present moment by the clock that blobs get their times from."""
        return datetime.now(UTC) if self._remote is None else self._remote.now()

    def read_store_id(self) -> str | None:
        """The store that the blobs say they belong to; None where they don't say."""
        text = self._store_id_text()
        return None if text is None else text.removeprefix(UNSETTLED)

    @property
    def is_settled(self) -> bool:
        """Whether the blobs belong to a store whose database is known to say so, too."""
        text = self._store_id_text()
        return text is not None and not text.startswith(UNSETTLED)

    def cached_store_id(self) -> str | None:
        """The store of which the folder is no cache of an object store, but the only place; None elsewhere."""
        text = None if self._remote is None else self._local_store_id()
        return None if text is None else text.removeprefix(UNSETTLED)

    def write_store_id(self, store_id: str, *, settled: bool = True) -> None:
        """Let the blobs say, durably, which store they belong to; not ``settled``: or will, if the database agrees."""
        text = store_id if settled else f"{UNSETTLED}{store_id}"
        if self._remote is not None:
            self._remote.write(STORE_ID, text)
            return
        with disk_errors_named(), Spool(self._spool / uuid.uuid4().hex, self._name_store) as spool:
            spool.write(f"{text}\n".encode())
            spool.keep()

    def _store_id_text(self) -> str | None:
        return self._local_store_id() if self._remote is None else self._remote.read(STORE_ID)

    def _name_store(self, spooled: Path, _sha256: str) -> None:
        spooled.replace(self._blobs / STORE_ID)
        sync_folder(self._blobs)

    def _local_store_id(self) -> str | None:
        with disk_errors_named():
            try:
                return (self._blobs / STORE_ID).read_text(errors="backslashreplace").strip()
            except FileNotFoundError:
                return None

    def _require_own(self) -> None:
        """That what is mounted here is still the folder that was opened: a missing disk leaves an empty one."""
        if self.store_id is not None and (found := self.read_store_id()) != self.store_id:
            raise StorageUnavailable(f"{self}: its store id was {self.store_id} and is {found}; is its disk there?")

    def _take_in(self, spooled: Path, sha256: str) -> None:
        """Make a spooled file, which is on the disk already, a blob."""
        if self._remote is not None:
            self._remote.put(sha256, spooled)
        size = spooled.stat().st_size
        move(spooled, self._place(sha256))
        self._require_own()
        if self._remote is not None:
            self._make_room(size)

    def _fetch(self, remote: ObjectStore, sha256: str, path: Path) -> Path:
        with self.spool() as spool:
            try:
                remote.get(sha256, spool.path)
            except NotFound:
                if not self.quarantine.recall(sha256):
                    raise
                remote.get(sha256, spool.path)
            spool.adopt()
            if spool.sha256 != sha256:
                raise BlobDamaged(sha256, spool.sha256)
            with disk_errors_named():
                move(spool.path, path)
        self._make_room(path.stat().st_size)
        return path

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

    def _local(self, before: datetime | None) -> Iterator[str]:
        latest = None if before is None else before.timestamp()
        for path in self._blobs.glob("??/*"):
            with suppress(FileNotFoundError):
                if _SHA256.fullmatch(path.name) and (latest is None or path.stat().st_mtime < latest):
                    yield path.name

    def _place(self, sha256: str) -> Path:
        if not _SHA256.fullmatch(sha256):
            raise NotFound("blob", sha256)
        return self._blobs / sha256[:2] / sha256


def open_blobs(folder: Path, url: str | None = None, cache_bytes: int = 0) -> BlobStore:
    """The blobs in a folder, or those of the object store at ``url`` with the folder as their cache."""
    return BlobStore(folder, None if url is None else ObjectStore(url), cache_bytes)


def _remove(path: Path) -> None:
    if path.is_dir():  # of a reader
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)


def _identity(path: Path) -> tuple[int, int] | Path:
    """What a file or folder is by whichever name; one that is not there yet is its name."""
    with suppress(OSError):
        status = path.stat()
        return status.st_dev, status.st_ino
    return path.resolve()


def _way_to(path: Path) -> set[tuple[int, int] | Path]:
    """The file or folder, and all folders that it is in."""
    resolved = path.resolve()
    return {_identity(each) for each in (resolved, *resolved.parents)}


def _state(path: Path) -> tuple[int, ...]:
    """What is another once somebody has written to a file, or put another in its place."""
    with disk_errors_named():
        status = path.stat()
    return status.st_ino, status.st_size, status.st_mtime_ns


def _hash(path: Path) -> str:
    with disk_errors_named(), path.open("rb") as stream:
        return hashlib.file_digest(stream, hashlib.sha256).hexdigest()
