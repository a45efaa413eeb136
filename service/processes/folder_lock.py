"""Who works in a data folder: any number of processes, which enter one after the other.

Only one that is alone may sweep orphans: under another's uploads it would lose them.
"""

import fcntl
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def shared(folder: Path, enter: Callable[[bool], None]) -> Iterator[None]:
    """Work in the folder, which is there, after ``enter`` was called with whether nobody else does.

    The locks end with the process, however that ends.
    """
    with (folder / "server.lock").open("w") as work:
        with (folder / "start.lock").open("w") as start:
            fcntl.flock(start, fcntl.LOCK_EX)
            enter(_alone(work.fileno()))
            fcntl.flock(work, fcntl.LOCK_SH)
        yield


def _alone(handle: int) -> bool:
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True
