"""A layer of files, and of SQLite statements, that fails once, at a chosen point between two system calls."""

import errno
import io
import os
import shutil
import sqlite3.dbapi2
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, Literal

import pytest

Fault = Literal["EIO", "ENOSPC", "short write"]
FAULTS: tuple[Fault, ...] = ("EIO", "ENOSPC", "short write")


class FaultyLayer:
    """Counts the points that are passed, and fails at the one that was armed; what comes after it works again.

    Points stand before each opening, write, flush, fsync, close, rename, making and unlinking of a file and folder, and
    before each statement of SQLite; at its commits there is one before and one after, where the answer is lost.
    """

    def __init__(self) -> None:
        self.at = -1
        self.fault: Fault = "EIO"
        self.passed: list[str] = []
        self.fired: str | None = None

    def arm(self, at: int, fault: Fault) -> None:
        """Fail at the point of this number, counted from now."""
        self.at, self.fault, self.passed, self.fired = at, fault, [], None

    def disarm(self) -> str | None:
        """Fail no more; returns the point at which it failed."""
        self.at = -1
        return self.fired

    def is_due(self, point: str) -> bool:
        if self.at < 0:
            return False
        self.passed.append(point)
        if len(self.passed) - 1 != self.at:
            return False
        self.fired = point
        return True

    def file_point(self, point: str) -> None:
        if self.is_due(point):
            raise self.os_error()

    def statement_point(self, point: str) -> None:
        if self.is_due(point):
            raise sqlite3.OperationalError("disk I/O error" if self.fault == "EIO" else "database or disk is full")

    def os_error(self) -> OSError:
        number = errno.EIO if self.fault == "EIO" else errno.ENOSPC
        return OSError(number, os.strerror(number))


class FaultyFile:
    """A file that is open for writing."""

    def __init__(self, layer: FaultyLayer, file: Any) -> None:
        self._layer, self._file = layer, file

    def write(self, chunk: bytes) -> int:
        if self._layer.is_due("write"):
            if self._layer.fault == "short write":
                self._file.write(bytes(chunk)[: len(chunk) // 2])
            raise self._layer.os_error()
        return int(self._file.write(chunk))

    def flush(self) -> None:
        self._layer.file_point("flush")
        self._file.flush()

    def close(self) -> None:
        self._file.close()
        self._layer.file_point("close")

    def __enter__(self) -> "FaultyFile":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __getattr__(self, name: str) -> Any:
        return getattr(self._file, name)


def faulty_connection(layer: FaultyLayer) -> type[sqlite3.Connection]:
    class Cursor(sqlite3.Cursor):
        def execute(self, statement: str, *given: Any) -> Any:
            layer.statement_point(statement.split("(")[0][:40])
            return super().execute(statement, *given)

        def executemany(self, statement: str, *given: Any) -> Any:
            layer.statement_point(statement.split("(")[0][:40])
            return super().executemany(statement, *given)

    class Connection(sqlite3.Connection):
        def cursor(self, *_: Any) -> Any:
            return super().cursor(Cursor)

        def commit(self) -> None:
            if not self.in_transaction:
                return
            layer.statement_point("before commit")
            super().commit()
            layer.statement_point("after commit")

    return Connection


@pytest.fixture
def layer(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[FaultyLayer]:
    """Under everything but the folders of other tests, whose servers may be at work in other threads.

    Ask for it before anything that opens a database.
    """
    made = FaultyLayer()

    def is_own(place: object) -> bool:
        if isinstance(place, int):
            place = os.readlink(f"/proc/self/fd/{place}")
        return str(tmp_path.parent) not in str(place) or str(tmp_path) in str(place)

    def before(owner: Any, name: str) -> None:
        original: Callable[..., Any] = getattr(owner, name)

        def faulty(*given: Any, **options: Any) -> Any:
            if is_own(given[0]):
                made.file_point(name)
            return original(*given, **options)

        monkeypatch.setattr(owner, name, faulty)

    opening = Path.open

    def open_faulty(path: Path, mode: str = "r", *given: Any, **options: Any) -> Any:
        if tmp_path in path.parents:  # what the system tells of a process is no storage
            made.file_point(f"open {mode}")
        file: io.IOBase = opening(path, mode, *given, **options)
        return FaultyFile(made, file) if mode in ("xb", "wb") and is_own(path) else file

    monkeypatch.setattr(Path, "open", open_faulty)
    before(os, "fsync")
    before(shutil, "copyfile")
    for name in ("replace", "mkdir", "unlink", "touch"):
        before(Path, name)
    connecting = sqlite3.dbapi2.connect
    factory = faulty_connection(made)

    def connect(*given: Any, **options: Any) -> Any:
        if not is_own(given[0]):
            return connecting(*given, **options)
        made.statement_point("connect")
        return connecting(*given, factory=factory, **options)

    monkeypatch.setattr(sqlite3.dbapi2, "connect", connect)
    yield made
    made.disarm()
    assert tmp_path
