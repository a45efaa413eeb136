"""The files of an SQLite database, which may be deleted or replaced under the process that has them open.

Whoever writes to a deleted file is told that all went well, and whoever opens its name again gets a new, empty one.
"""

import os
import sqlite3
from contextlib import closing
from pathlib import Path

from db.errors import StorageUnavailable

SIDE_FILES = ("-wal", "-shm")
"""What is beside the file as long as any connection has read from it: commits go to the first of them."""


class SqliteFile:
    """A file that stays the one that was opened first, with those beside it: by their names, devices and inodes."""

    def __init__(self, path: str | None) -> None:
        self._path = None if path is None else Path(path).absolute()
        self._first: tuple[int, int] | None = None
        self._open: set[int] = set()
        self._side_files: list[tuple[int, int] | None] = []

    def note_opened(self, connection: object) -> None:
        """Remember the files, which are there once a connection has read anything; in memory there are none."""
        if self._first is None:
            self._first = self._identity()
        if not self._open:
            self._side_files = [self._identity(suffix) for suffix in SIDE_FILES]
        self._open.add(id(connection))

    def note_closing(self, connection: object) -> None:
        """Forget a connection; the last one of all processes deletes the files beside the database when it closes."""
        self._open.discard(id(connection))

    def require(self) -> None:
        """Make sure that they are still there; raises ``StorageUnavailable``."""
        if self._first is not None and self._identity() != self._first:
            raise self._lost()
        for suffix, opened in zip(SIDE_FILES, self._side_files, strict=False):
            if self._identity(suffix) != opened and self._open:
                raise self._lost(suffix)

    def check_head(self) -> None:
        """Read its header and schema from the disk, past what connections remember.

        Raises ``StorageUnavailable``, ``sqlite3.Error``.
        """
        self._ask("SELECT count(*) FROM sqlite_master")

    def check_pages(self) -> None:
        """Read every page and look whether they fit together; raises ``StorageUnavailable``, ``sqlite3.Error``."""
        found = self._ask("PRAGMA quick_check(1)")
        if found != "ok":
            raise StorageUnavailable(f"database file {self._path} is damaged: {found}; allowed: restore a backup")

    def _ask(self, statement: str) -> object:
        if self._first is None or self._path is None:
            return "ok"
        self.require()  # where a file beside it is gone, even who only reads would make an empty one
        with closing(sqlite3.connect(f"{self._path.as_uri()}?mode=ro", uri=True)) as connection:
            return connection.execute(statement).fetchone()[0]

    def _identity(self, suffix: str = "") -> tuple[int, int] | None:
        try:
            stat = os.stat(f"{self._path or ''}{suffix}")
        except OSError:
            return None
        return stat.st_dev, stat.st_ino

    def _lost(self, suffix: str = "") -> StorageUnavailable:
        what = f"database file {self._path}{suffix} was deleted or replaced while it was in use"
        return StorageUnavailable(f"{what}; allowed: the same file put back, or a restart")
