"""Files and folders that are written whole or not at all."""

import os
import shutil
from collections.abc import Callable
from errno import EACCES, EISDIR, ENOTDIR
from pathlib import Path
from tempfile import mkdtemp

PREFIX, SUFFIX = ".stiction-", ".part"
"""Of the hidden folder in which something is written; a killed writer leaves it, and nobody reads it."""


def write_whole(path: Path, write: Callable[[Path], object]) -> Path:
    """Let ``write`` make a file or a folder beside ``path``, put it there once it is whole, and return the path.

    It is made in a new hidden folder, so that nothing of anybody else's is in its way. A link is followed. A folder
    takes the place of an empty one at most: raises ``OSError`` where there is another, or a device, and of a full disk,
    which name ``path``. What was written before an error goes.
    """
    target = _target(path)
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        beside = Path(mkdtemp(SUFFIX, PREFIX, target.parent))
    except OSError as error:  # of a folder that nobody has named
        raise OSError(error.errno, error.strerror, str(path)) from error
    try:
        write(beside / target.name)
        (beside / target.name).replace(target)
    except OSError as error:
        is_own = error.filename is None or Path(str(error.filename)).is_relative_to(beside)
        if error.errno is None or not is_own:
            raise  # of what is read
        raise OSError(error.errno, error.strerror, str(path)) from error
    finally:
        shutil.rmtree(beside)
    return path


def check_place(path: Path) -> None:
    """Raises ``OSError`` where no file may be written, before what takes long is done for it; makes nothing."""
    target = _target(path)
    if target.is_dir():
        raise IsADirectoryError(EISDIR, os.strerror(EISDIR), str(path))
    folder = next(folder for folder in target.parents if folder.exists())
    if not folder.is_dir():
        raise NotADirectoryError(ENOTDIR, os.strerror(ENOTDIR), str(path))
    if not os.access(folder, os.W_OK | os.X_OK):
        raise PermissionError(EACCES, os.strerror(EACCES), str(path))


def _target(path: Path) -> Path:
    """What a path leads to; raises ``OSError`` where that is a device."""
    target = Path(os.path.realpath(path))
    if target.exists() and not (target.is_file() or target.is_dir()):
        raise FileExistsError(f"{path} is there and is neither a file nor a folder")
    return target
