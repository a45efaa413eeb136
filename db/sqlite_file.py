"""The files of an SQLite database, which may be deleted or replaced under the process that has them open.

Whoever writes to a deleted file is told that all went well, and whoever opens its name again gets a new, empty one.
An older copy that is written over it keeps its name and inode: it shows by what never falls otherwise, the generation
in its header. SQLite itself takes the header from the write-ahead log where that has a newer one, but for a file that
is said to be immutable. Nobody here opens it past SQLite: closing it would end SQLite's locks.

The log of a newer file would make a mixture of an older copy. SQLite writes it there when the last connection closes,
and when the next one opens: where generations tell, the first is kept from happening and the second is refused. They
do not tell a copy from before a VACUUM, a migration or a restore, nor a file that is newer than the log beside it.
"""

import ctypes
import os
import sqlite3
from contextlib import closing, suppress
from pathlib import Path
from typing import Any

from db.errors import StorageUnavailable
from db.write_ahead_log import first_generation

SIDE_FILES = ("-wal", "-shm")
"""What is beside the file as long as any connection has read from it: commits go to the first of them."""

ANY_SIZE = "PRAGMA writable_schema = ON"
"""Lets SQLite take a header that tells more pages than the file has, as it may in the middle of a checkpoint."""

WITHOUT_LOG = "before a start on an older copy, move away -wal and -shm beside it, which hold nothing of it"

GENERATION = "PRAGMA user_version"
"""What the file's header says of how often it was written to; each transaction writes one more."""

_CYCLE = 2**32
"""Generations after which the header's field of 32 bits begins anew."""

OLDEST = -(2**30)
"""Of a backup's file as it was written: older than any database that has been in use since it was made."""


class SqliteFile:
    """A file that stays the one that was opened first, with those beside it: by their names, devices and inodes."""

    def __init__(self, path: str | None) -> None:
        self._path = None if path is None else Path(path).absolute()
        self._beside = None if path is None else Path(path).resolve()  # of a link, SQLite's files are beside its target
        self._first: tuple[int, int] | None = None
        self._generation: int | None = None
        self._generation_in_file: int | None = None
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
        if self._first is None:
            self._require_own_log()
        else:
            self._require_newer(self._generation_in_file)  # other threads may note a higher one meanwhile
        for suffix, opened in zip(SIDE_FILES, self._side_files, strict=False):
            if _identity(self._stat(suffix)) != opened and self._open:
                raise self._lost(suffix)

    def check_before_close(self) -> None:
        """An older copy is noticed at the latest here, and gets nothing of the log."""
        with suppress(StorageUnavailable):
            self.require()
            self._require_own_log()

    def _require_own_log(self) -> None:
        """At first, and at looks: a log whose first header is two generations on is another file's."""
        if self._path is None or self._beside is None:
            return
        in_log = first_generation(Path(f"{self._beside}-wal"))  # first: a file that others work on only gets newer
        if in_log is None:
            return
        if not self._path.is_file():  # SQLite would make a new one, and delete the log
            what = f"database file {self._path} is not there, and its write-ahead log {self._beside}-wal is"
            raise StorageUnavailable(f"{what}; allowed: the file put back, or a new one once -wal was moved away")
        if is_older(in_file := self._read_header(), in_log - 1):
            if self._open:
                self._keep_log()
            raise StorageUnavailable(
                f"database file {self._path} is of generation {in_file}, and its write-ahead log {self._beside}-wal "
                f"follows one of {in_log - 1} or more: an older copy was written over the file; allowed: the file of "
                f"before, or the older one; {WITHOUT_LOG}"
            )

    def _require_newer(self, generation: int | None) -> None:
        """The first file, which has never been of a lower generation than that."""
        if _identity(self._stat()) != self._first:
            raise self._lost()
        in_file = self._read_header()
        if generation is not None and is_older(in_file, generation):
            self._keep_log()
            raise self._overwritten(in_file, generation)
        self._generation_in_file = in_file

    def _keep_log(self) -> None:
        """Let SQLite write the log into the file at no close: one connection never is, not even as the process ends."""
        if not self._log_is_kept and self._path is not None:
            self._log_is_kept = True
            connection = sqlite3.connect(f"{self._path.as_uri()}?mode=ro", uri=True, check_same_thread=False)
            ctypes.pythonapi.Py_IncRef(ctypes.py_object(connection))
            with suppress(sqlite3.Error):
                connection.execute(GENERATION).fetchone()  # from now on it has the lock that others would need

    def _read_header(self) -> int:
        """The generation in the file, whatever is in the write-ahead log."""
        try:
            return int(self._first_cell(GENERATION, "immutable=1", ANY_SIZE))
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
            raise self._overwritten(generation, least)
        self._generation = generation
        self._require_own_log()

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
        return self._first_cell(statement, "mode=ro")

    def _first_cell(self, statement: str, options: str, *before: str) -> Any:
        assert self._path is not None
        with closing(sqlite3.connect(f"{self._path.as_uri()}?{options}", uri=True)) as connection:
            for each in before:
                connection.execute(each)
            return connection.execute(statement).fetchone()[0]

    def _stat(self, suffix: str = "") -> os.stat_result | None:
        try:
            return os.stat(f"{self._beside}{suffix}" if suffix else self._path or "")
        except OSError:
            return None

    def _lost(self, suffix: str = "") -> StorageUnavailable:
        what = f"database file {self._path}{suffix} was deleted or replaced while it was in use"
        return StorageUnavailable(f"{what}; allowed: the same file put back, or a restart")

    def _overwritten(self, found: int, least: int) -> StorageUnavailable:
        what = f"{self._lost()} (it is of generation {found} and was of {least}; {WITHOUT_LOG})"
        return StorageUnavailable(what)


def after(generation: int) -> int:
    """The next one; beyond 2³¹ − 1 the field goes on at its other end."""
    return (generation + 1 + _CYCLE // 2) % _CYCLE - _CYCLE // 2


def is_older(generation: int, other: int) -> bool:
    """By serial numbers (RFC 1982), of which the one that is less than half a cycle behind is older."""
    return (generation - other) % _CYCLE > _CYCLE // 2


def _identity(file: os.stat_result | None) -> tuple[int, int] | None:
    return None if file is None else (file.st_dev, file.st_ino)
