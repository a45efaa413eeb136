"""The logs that files and folders on a command line hold, in the order in which they are named."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from json import dumps, loads
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from service.cli.inputs import mapping_text

if TYPE_CHECKING:
    from slipcore import GraspLog

ROSBAG2_DESCRIPTION = "metadata.yaml"
Mapping = dict[str, Any]


@dataclass(frozen=True, slots=True)
class Source:
    """A log by its name, and what gives it with its upload's options: a file as it is, or a log that was read here."""

    name: str
    log: "Callable[[], tuple[Path | GraspLog, Mapping]]"


def found(paths: Sequence[Path], mapping: Path | None, **table: Any) -> list[Source]:
    """Each file, each recording that is a folder, each episode of a LeRobot data set, each file of other folders.

    ``table`` is what else reading takes (``scale``, ``frame_rate``, ``rest``): logs are read here where rest is a file.
    Raises ``InvalidInput`` for a mapping or a data set that is wrong, ``BadParameter`` for a folder without files.
    """
    from service.formats.mapping import parse

    text = mapping_text(mapping)
    entries = None if text is None else loads(parse(text).text)
    return [
        source
        for path in paths
        for source in (_of_folder(path, entries, table) if path.is_dir() else [_file(path, entries, table)])
    ]


def _file(path: Path, mapping: Mapping | None, table: Mapping) -> Source:
    if isinstance(table.get("rest"), Path):
        return _read_here(path.name, path, mapping, table)
    return Source(path.name, lambda: (path, {"mapping": mapping, **table}))


def _of_folder(folder: Path, mapping: Mapping | None, table: Mapping) -> Iterator[Source]:
    from service import formats
    from service.formats import tac3d

    if (folder / formats.LEROBOT_INFO).is_file():
        yield from _episodes(folder, mapping, table)
    elif (folder / ROSBAG2_DESCRIPTION).is_file():
        yield _read_here(folder.name, folder, mapping, table)
    elif any((folder / f"{name}.npy").is_file() for name in tac3d.REQUIRED):
        yield _file(folder, mapping, table)
    else:
        files = sorted(path for path in folder.iterdir() if path.is_file() and not path.name.startswith("."))
        if not files:
            raise typer.BadParameter(f"{folder} has no files in it")
        yield from (_file(path, mapping, table) for path in files)


def _episodes(folder: Path, mapping: Mapping | None, table: Mapping) -> Iterator[Source]:
    from service import formats

    for number in formats.episodes_of(folder, None if mapping is None else dumps(mapping)):
        yield _read_here(f"{folder.name} episode {number}", folder, {**(mapping or {}), "episode": number}, table)


def _read_here(name: str, path: Path, mapping: Mapping | None, table: Mapping) -> Source:
    return Source(name, partial(_log, path, mapping, table))


def _log(path: Path, mapping: Mapping | None, table: Mapping) -> "tuple[GraspLog, Mapping]":
    from service import formats

    return formats.read(path, mapping=None if mapping is None else dumps(mapping), **table), {}
