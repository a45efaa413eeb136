"""Blobs to which nothing refers, set aside: they are found again where somebody needs them, and deleted later."""

import os
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from datetime import datetime
from pathlib import Path
from typing import Protocol


class Quarantine(Protocol):
    """What holds the blobs that were set aside."""

    def put(self, sha256: str) -> None:
        """Set a blob aside, as of now; one that isn't there is no error."""

    def recall(self, sha256: str) -> bool:
        """Make it a blob again; False if it was not set aside."""

    def hashes(self, before: datetime | None = None) -> Iterator[str]:
        """Hashes of all that were set aside, or of those before a moment."""

    def delete(self, hashes: Iterable[str]) -> None:
        """Delete for good."""


class FolderQuarantine:
    """A folder beside the blobs; ``place`` shows where a blob belongs."""

    def __init__(self, folder: Path, place: Callable[[str], Path]) -> None:
        self._folder, self._place = folder, place

    def put(self, sha256: str) -> None:
        """Set a blob aside, as of now; one that isn't there is no error."""
        path = self._place(sha256)
        with suppress(FileNotFoundError):
            os.utime(path)
            move(path, self._folder / sha256)

    def recall(self, sha256: str) -> bool:
        """Make it a blob again; False if it was not set aside."""
        if not (self._folder / sha256).is_file():
            return False
        with suppress(FileNotFoundError):  # another reader was faster
            move(self._folder / sha256, self._place(sha256))
        return True

    def hashes(self, before: datetime | None = None) -> Iterator[str]:
        """Hashes of all that were set aside, or of those before a moment."""
        latest = None if before is None else before.timestamp()
        for path in self._folder.glob("?" * 64):
            with suppress(FileNotFoundError):
                if latest is None or path.stat().st_mtime < latest:
                    yield path.name

    def delete(self, hashes: Iterable[str]) -> None:
        """Delete for good."""
        for sha256 in hashes:
            (self._folder / sha256).unlink(missing_ok=True)


def move(source: Path, target: Path) -> None:
    """Atomic and durable: file, then name, then folder reach the disk; a blob of that name has the same bytes."""
    _make_folder(target.parent)
    source.replace(target)
    sync_folder(target.parent)


def sync_folder(folder: Path) -> None:
    """Let the names in a folder reach the disk."""
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def _make_folder(folder: Path) -> None:
    if not folder.is_dir():
        folder.mkdir(exist_ok=True)
        sync_folder(folder.parent)
