"""The file of an SQLite database, which may be deleted or replaced under the process that has it open.

Whoever writes to a deleted file is told that all went well, and whoever opens its name again gets a new, empty one.
"""

import os
import sqlite3
from contextlib import closing
from pathlib import Path

from db.errors import StorageUnavailable


class SqliteFile:
    """A file that stays the one that was opened first: by its name, device and inode."""

    def __init__(self, path: str | None) -> None:
        self._path = None if path is None else Path(path).absolute()
        self._first: tuple[int, int] | None = None

    def note_opened(self) -> None:
        """Remember the file, which is there by now; one in memory is none."""
        if self._first is None:
            self._first = self._identity()

    def require(self) -> None:
        """Make sure that it is still there; raises ``StorageUnavailable``."""
        if self._first is not None and self._identity() != self._first:
            raise StorageUnavailable(
                f"database file {self._path} was deleted or replaced while it was in use; allowed: the same file put "
                "back, or a restart"
            )

    def check_head(self) -> None:
        """Read its header and schema from the disk, past what connections remember; raises ``sqlite3.Error``."""
        self._ask("SELECT count(*) FROM sqlite_master")

    def check_pages(self) -> None:
        """Read every page and look whether they fit together; raises ``StorageUnavailable``, ``sqlite3.Error``."""
        found = self._ask("PRAGMA quick_check(1)")
        if found != "ok":
            raise StorageUnavailable(f"database file {self._path} is damaged: {found}; allowed: restore a backup")

    def _ask(self, statement: str) -> object:
        if self._first is None or self._path is None:
            return "ok"
        with closing(sqlite3.connect(f"{self._path.as_uri()}?mode=ro", uri=True)) as connection:
            return connection.execute(statement).fetchone()[0]

    def _identity(self) -> tuple[int, int] | None:
        try:
            stat = os.stat(self._path or "")
        except OSError:
            return None
        return stat.st_dev, stat.st_ino
