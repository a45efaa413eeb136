"""The files of an SQLite database, which may be deleted or replaced under the process that has them open.

Whoever writes to a deleted file is told that all went well, and whoever opens its name again gets a new, empty one.
Another copy that is written over it keeps its name and inode: it shows by its header, which each transaction renews.
SQLite itself takes the header from the write-ahead log where that has a newer one, but for a file that is said to be
immutable. Nobody here opens it past SQLite: closing it would end SQLite's locks.

The log of another file would make a mixture of the copy. SQLite writes it there when the last connection closes, and
when the next one opens: the first is kept from happening, the second is refused.
"""

import ctypes
import os
import sqlite3
import time
from contextlib import closing, suppress
from pathlib import Path
from typing import Any

from db.errors import StorageUnavailable
from db.file_header import GENERATION, FileHeader, is_older
from db.write_ahead_log import headers

SIDE_FILES = ("-wal", "-shm")
"""What is beside the file as long as any connection has read from it: commits go to the first of them."""

ANY_SIZE = "PRAGMA writable_schema = ON"
"""Lets SQLite take a header that states more pages than the file has, as it may in the middle of a checkpoint."""

WITHOUT_LOG = "before a start on another copy, move away -wal and -shm beside it, which hold nothing of it"

LOOKS = 6
"""At file and log, which cannot be read in one moment, before they are said not to belong together."""

BETWEEN_LOOKS = 6e-3
"""Seconds, doubled each time; another process may be writing a checkpoint or beginning the log anew."""


class SqliteFile:
    """A file that stays the one that was opened first, with those beside it: by their names, devices and inodes."""

    def __init__(self, path: str | None) -> None:
        self._path = None if path is None else Path(path).absolute()
        self._beside = None if path is None else Path(path).resolve()  # of a link, SQLite's files are beside its target
        self._first: tuple[int, int] | None = None
        self._generation: int | None = None
        self._header: FileHeader | None = None
        self._log_is_kept = False
        self._open: set[int] = set()
        self._side_files: list[tuple[int, int] | None] = []

    def note_opened(self, connection: object) -> None:
        """Remember the files, which are there once a connection has read anything; in memory there are none."""
        if self._first is None:
            self._first = _identity(self._stat())
        if not self._open:
            self._side_files = [_identity(self._stat(suffix)) for suffix in SIDE_FILES]
        self._open.add(id(connection))

    def note_closing(self, connection: object) -> None:
        """Forget a connection; the last one of all processes deletes the files beside the database when it closes."""
        self._open.discard(id(connection))

    def require(self) -> None:
        """Make sure that they are still there; raises ``StorageUnavailable``."""
        if self._first is not None and _identity(self._stat()) != self._first:
            raise self._lost()
        known = self._header
        if known is None or known != self._read_header():
            self._require_own_log(known)  # other threads may note a newer one meanwhile
        for suffix, opened in zip(SIDE_FILES, self._side_files, strict=False):
            if _identity(self._stat(suffix)) != opened and self._open:
                raise self._lost(suffix)

    def check_before_close(self) -> None:
        """Another copy is noticed at the latest here, and gets nothing of the log."""
        with suppress(StorageUnavailable):
            self.require()
            self._require_own_log(self._header)

    def _require_own_log(self, known: FileHeader | None) -> None:
        """Make sure that the log is this file's, and the file no older than its ``known`` header."""
        if self._path is None or not self._is_there():
            return
        log = Path(f"{self._beside}-wal")
        for look in range(LOOKS):
            found = self._read_header()
            if _belongs(found, headers(log), known):
                self._header = found
                return
            time.sleep(BETWEEN_LOOKS * 2**look)
        if self._open:
            self._keep_log()
        if self._first is not None:
            raise self._lost()
        what = f"database file {self._path} is not the one that its write-ahead log {log} follows"
        allowed = f"allowed: the file of before, or the other copy; {WITHOUT_LOG}"
        raise StorageUnavailable(f"{what}: another copy was put in its place; {allowed}")

    def _is_there(self) -> bool:
        """Or nothing is, of which SQLite makes a new database; it would delete a log that is there alone."""
        log = self._stat("-wal")  # first: SQLite makes the file before it
        is_there = self._stat() is not None
        if not is_there and log is not None and log.st_size > 0:
            what = f"database file {self._path} is not there, and its write-ahead log {self._beside}-wal is"
            raise StorageUnavailable(f"{what}; allowed: the file put back, or a new one once -wal was moved away")
        return is_there

    def _keep_log(self) -> None:
        """Let SQLite write the log into the file at no close: one connection never is, not even as the process ends."""
        if not self._log_is_kept and self._path is not None:
            self._log_is_kept = True
            connection = sqlite3.connect(f"{self._path.as_uri()}?mode=ro", uri=True, check_same_thread=False)
            ctypes.pythonapi.Py_IncRef(ctypes.py_object(connection))
            with suppress(sqlite3.Error):
                connection.execute(GENERATION).fetchone()  # from now on it has the lock that others would need

    def _read_header(self) -> FileHeader:
        """The header in the file, whatever is in the write-ahead log."""
        try:
            with self._connection("immutable=1") as connection:
                connection.execute(ANY_SIZE)
                return FileHeader.of_connection(connection)
        except sqlite3.Error as error:
            raise StorageUnavailable(f"database file {self._path}: {error}; allowed: restore a backup") from error

    def check_head(self) -> None:
        """Read its header and schema from the disk, past what connections remember.

        Raises ``StorageUnavailable``, ``sqlite3.Error``.
        """
        self._ask("SELECT count(*) FROM sqlite_master")
        least, generation = self._generation, self._ask(GENERATION)
        if generation is None:
            return
        if least is not None and is_older(generation, least):
            raise self._lost()
        self._generation = generation
        self._require_own_log(self._header)

    def check_pages(self) -> None:
        """Read every page and look whether they fit together; raises ``StorageUnavailable``, ``sqlite3.Error``."""
        found = self._ask("PRAGMA integrity_check(1)")
        if found not in (None, "ok"):
            raise StorageUnavailable(f"database file {self._path} is damaged: {found}; allowed: restore a backup")

    def _ask(self, statement: str) -> Any:
        """The first cell of the answer; None where there is no file."""
        if self._first is None or self._path is None:
            return None
        self.require()  # where a file beside it is gone, even who only reads would make an empty one
        with self._connection("mode=ro") as connection:
            return connection.execute(statement).fetchone()[0]

    def _connection(self, options: str) -> closing[sqlite3.Connection]:
        assert self._path is not None
        return closing(sqlite3.connect(f"{self._path.as_uri()}?{options}", uri=True))

    def _stat(self, suffix: str = "") -> os.stat_result | None:
        try:
            return os.stat(f"{self._beside}{suffix}" if suffix else self._path or "")
        except OSError:
            return None

    def _lost(self, suffix: str = "") -> StorageUnavailable:
        what = f"database file {self._path}{suffix} was deleted or replaced while it was in use"
        return StorageUnavailable(f"{what}; allowed: the same file put back, or a restart ({WITHOUT_LOG})")


def _belongs(found: FileHeader, log: list[FileHeader], known: FileHeader | None) -> bool:
    """Whether the ``found`` header of the file is one that the ``log`` holds or follows, none before the ``known`` one.

    A log that holds none may have been emptied, which says no more than the count.
    """
    if not log:
        return known is None or not is_older(found.generation, known.generation)
    place, before = _place(found, log), None if known is None else _place(known, log)
    return place is not None and (before is None or before <= place)


def _place(header: FileHeader, log: list[FileHeader]) -> int | None:
    """How many headers of the ``log`` the file has already; None where the log is of another file."""
    if header in log:
        return len(log) - log[::-1].index(header)
    return 0 if log[0].follows(header) else None


def _identity(file: os.stat_result | None) -> tuple[int, int] | None:
    return None if file is None else (file.st_dev, file.st_ino)
