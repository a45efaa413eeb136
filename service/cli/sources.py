"""The logs that files and folders on a command line hold, in the order in which they are named."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from json import dumps, loads
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from service.cli.local import mapping_text

if TYPE_CHECKING:
    from slipcore import GraspLog

ROSBAG2_DESCRIPTION = "metadata.yaml"
Mapping = dict[str, Any]


@dataclass(frozen=True, slots=True)
class Source:
    """A log by its name, and what gives it: a file as it is with its mapping, or a log that was read here."""

    name: str
    log: "Callable[[], tuple[Path | GraspLog, Mapping | None]]"


def found(paths: Sequence[Path], mapping: Path | None) -> list[Source]:
    """Each file, each recording that is a folder, each episode of a LeRobot data set, each file of other folders.

    Raises ``InvalidInput`` for a mapping or a data set that is wrong, ``BadParameter`` for a folder without files.
    """
    from service.formats.mapping import parse

    text = mapping_text(mapping)
    told = None if text is None else loads(parse(text).text)
    return [source for path in paths for source in (_of_folder(path, told) if path.is_dir() else [_file(path, told)])]


def _file(path: Path, mapping: Mapping | None) -> Source:
    return Source(path.name, lambda: (path, mapping))


def _of_folder(folder: Path, mapping: Mapping | None) -> Iterator[Source]:
    from service import formats
    from service.formats import tac3d

    if (folder / formats.LEROBOT_INFO).is_file():
        yield from _episodes(folder, mapping)
    elif (folder / ROSBAG2_DESCRIPTION).is_file():
        yield _read_here(folder.name, folder, mapping)
    elif any((folder / f"{name}.npy").is_file() for name in tac3d.REQUIRED):
        yield _file(folder, mapping)
    else:
        files = sorted(path for path in folder.iterdir() if path.is_file() and not path.name.startswith("."))
        if not files:
            raise typer.BadParameter(f"{folder} has no files in it")
        yield from (_file(path, mapping) for path in files)


def _episodes(folder: Path, mapping: Mapping | None) -> Iterator[Source]:
    from service import formats

    for number in formats.episodes_of(folder, None if mapping is None else dumps(mapping)):
        yield _read_here(f"{folder.name} episode {number}", folder, {**(mapping or {}), "episode": number})


def _read_here(name: str, path: Path, mapping: Mapping | None) -> Source:
    return Source(name, partial(_log, path, mapping))


def _log(path: Path, mapping: Mapping | None) -> "tuple[GraspLog, None]":
    from service import formats

    return formats.read(path, mapping=None if mapping is None else dumps(mapping)), None
