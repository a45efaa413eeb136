"""One server a data folder: sweeping orphans under another one's uploads would lose them."""

import fcntl
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


class FolderInUse(RuntimeError):
    """Another server works in this data folder."""


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Hold the folder for this process; the lock ends with the process, however that ends. Raises ``FolderInUse``."""
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / "server.lock").open("w") as handle:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            raise FolderInUse(f"data folder is {folder}, in use by another server; allowed: one of its own") from error
        yield
