"""The data folder as it was set: made where it isn't there, and refused in words that name the setting."""

import errno
import os
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

LONGEST_TOLD = 200
"""Characters of a path that a message repeats."""

REASONS = {
    errno.ENOTDIR: "is a file, or in one",
    errno.EEXIST: "is a file, or in one",
    errno.EACCES: "this user may not read and write",
    errno.EPERM: "this user may not read and write",
    errno.EROFS: "is on a file system that is read-only",
    errno.ENOENT: "is in a folder that is not there and cannot be made",
    errno.ENAMETOOLONG: "is too long for the file system",
    errno.ELOOP: "leads in a circle of links",
    errno.ENOSPC: "is on a full disk, so that it cannot be made",
}


class UnusableFolder(OSError):
    """The data folder cannot be one; the message says why, and what to do."""


def prepare(folder: Path) -> None:
    """Make the folder, if it isn't there; raises ``UnusableFolder`` for one that cannot be made, read or written."""
    with _named(folder):
        folder.mkdir(parents=True, exist_ok=True)
        if not os.access(folder, os.R_OK | os.W_OK | os.X_OK):
            raise PermissionError(errno.EACCES, "no access")


def require_possible(folder: Path) -> None:
    """Raises ``UnusableFolder`` for what no folder can be; makes nothing, and one that isn't there is no error."""
    with _named(folder), suppress(FileNotFoundError):
        os.scandir(folder).close()


@contextmanager
def removed_unless_filled(folder: Path, parts: Iterable[str]) -> Iterator[None]:
    """Remove, where what is to fill the folder fails, the folders that were made for it and are still empty."""
    made = [each for each in (*(folder / part for part in parts), folder, *folder.parents) if not each.exists()]
    try:
        yield
    except BaseException:
        for each in made:
            with suppress(OSError):  # it was not made, or holds something
                each.rmdir()
        raise


@contextmanager
def _named(folder: Path) -> Iterator[None]:
    try:
        yield
    except ValueError as error:
        raise _unusable(folder, "has a NUL character") from error
    except OSError as error:
        why = REASONS.get(error.errno or 0, f"cannot be used ({error.strerror})")
        raise _unusable(folder, why) from error


def _unusable(folder: Path, why: str) -> UnusableFolder:
    allowed = "a folder that the service's user may read and write, or a path at which it may make one"
    named = f"STICTION_DATA_FOLDER (--data-folder) is {str(folder)[:LONGEST_TOLD]!r}, which {why}"
    return UnusableFolder(f"{named}; allowed: {allowed} (docs/settings.md)")
