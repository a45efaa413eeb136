"""Files and folders that are written whole or not at all."""

import shutil
from collections.abc import Callable
from pathlib import Path


def write_whole(path: Path, write: Callable[[Path], object]) -> Path:
    """Let ``write`` make a file or a folder beside ``path``, put it there once it is whole, and return the path.

    A folder takes the place of an empty one at most: raises ``OSError`` where there is another. What was written
    before an error goes.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    beside = path.with_name(f"{path.name}.part")
    _remove(beside)
    try:
        write(beside)
        return beside.replace(path)
    except BaseException:
        _remove(beside)
        raise


def _remove(path: Path) -> None:
    if path.is_dir():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)
