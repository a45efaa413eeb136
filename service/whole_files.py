"""Files and folders that are written whole or not at all."""

import os
import shutil
from collections.abc import Callable
from pathlib import Path
from tempfile import mkdtemp

PREFIX, SUFFIX = ".stiction-", ".part"
"""Of the hidden folder in which something is written; a killed writer leaves it, and nobody reads it."""


def write_whole(path: Path, write: Callable[[Path], object]) -> Path:
    """Let ``write`` make a file or a folder beside ``path``, put it there once it is whole, and return the path.

    It is made in a new hidden folder, so that nothing of anybody else's is in its way. A link is followed. A folder
    takes the place of an empty one at most: raises ``OSError`` where there is another, or a device. What was written
    before an error goes.
    """
    target = Path(os.path.realpath(path))
    if target.exists() and not (target.is_file() or target.is_dir()):
        raise FileExistsError(f"{path} is there and is neither a file nor a folder")
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        beside = Path(mkdtemp(SUFFIX, PREFIX, target.parent))
    except OSError as error:  # of a folder that nobody has named
        raise OSError(error.errno, error.strerror, str(path)) from error
    try:
        write(beside / target.name)
        (beside / target.name).replace(target)
    finally:
        shutil.rmtree(beside)
    return path
