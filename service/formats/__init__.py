"""File formats of grasp logs, one module each."""

import importlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from types import ModuleType
from typing import Any

from service.formats import frame_table, presets, rest, tac3d, tracked_markers
from service.formats import mapping as mappings
from service.formats.archive import open_archive
from service.formats.delimited import split_header
from slipcore.errors import InvalidInput
from slipcore.frames import GraspLog

__all__ = [
    "CONTENT_TYPES",
    "FORMATS",
    "LEROBOT_INFO",
    "UNSPECIFIC_TYPES",
    "Format",
    "UnsupportedFormat",
    "UnusedSetting",
    "check_settings",
    "check_start",
    "episodes_of",
    "identify",
    "import_with_library",
    "module_of",
    "parse_mapping",
    "read",
]


@dataclass(frozen=True, slots=True)
class Format:
    """A format: its content type, where its reader is, how its files begin, which settings it takes, and which of the
    mapping's ``entries`` that not every format has a use for.

    ``plain``: read by our own bounded code; the others go through libraries, and so through a process of their own.
    ``leads``: nothing may stand before the magic bytes.
    """

    content_type: str
    reader: str
    magic: bytes = b""
    settings: tuple[str, ...] = ("mapping", "rest")
    entries: tuple[str, ...] = ()
    plain: bool = False
    leads: bool = True


FORMATS = {
    "npz": Format("application/vnd.stiction.grasp-log+npz", "npz.read", settings=(), plain=True),
    "tac3d": Format("application/vnd.tac3d+zip", "tac3d.read", settings=(), plain=True),
    "tracked markers": Format("text/csv", "tracked_markers.read", settings=("scale", "frame_rate", "rest")),
    "frame table": Format("application/vnd.stiction.frame-table+csv", "frame_table.read", entries=("notes", "element")),
    "mcap": Format("application/x-mcap", "mcap.read", b"\x89MCAP0\r\n", entries=("topic",)),
    "rosbag1": Format("application/x-rosbag", "rosbag.read_bag1", b"#ROSBAG V", entries=("topic",)),
    "rosbag2": Format("application/x-rosbag2", "rosbag.read_bag2", b"SQLite format 3\x00", entries=("topic",)),
    "hdf5": Format("application/x-hdf5", "hdf5.read", b"\x89HDF\r\n\x1a\n", leads=False),
    "parquet": Format("application/vnd.apache.parquet", "parquet.read", b"PAR1", entries=("episode",)),
    "json": Format("application/json", "json_log.read"),
}

CONTENT_TYPES = {each.content_type: name for name, each in FORMATS.items()}
"""Content types that name a format; the others below leave it to the file's own content."""

UNSPECIFIC_TYPES = ("application/zip", "application/octet-stream")

_WHERE = {
    "scale": "only beside a table of tracked markers: other formats are in SI units",
    "frame_rate": "only beside a table of tracked markers: other formats have times",
    "rest": "only beside tracked markers or a format of topics, fields or columns",
    "mapping": "only beside a format of topics, fields or columns",
}

_WHERE_IN_MAPPING = {
    "notes": "only for a table",
    "element": "only for a table",
    "episode": "only for Parquet (LeRobot)",
    "topic": "only for MCAP and bags",
}

PAGE = "docs/formats.md"
TABLES = (
    "the columns of tracked markers (time or frame, marker, x, y), or a mapping that says which columns are what "
    f"({PAGE} has examples)"
)
"""What is taken of delimited text."""

Settings = Mapping[str, float | str | Path | None]
NO_SETTINGS: Settings = {}

EXTRA = "formats"
"""The extra that brings the libraries of the formats that need some."""

STORAGE = (".db3", ".mcap")
"""Names of rosbag2's storage files end so."""

IN_FOLDERS = ("rosbag2", "parquet")
"""Formats with a mapping of which a log may be a folder."""

LEROBOT_INFO = "meta/info.json"
"""Where a LeRobot data set, which is a folder, describes itself."""

ZIP = b"PK\x03\x04"
"""How a zip begins."""

KNOWN = f"{', '.join(FORMATS)} ({PAGE})"
"""What a file may be, as people call it."""
SNIFFED_BYTES = 4096
"""Enough for the lines before a table and its header."""


class UnsupportedFormat(InvalidInput):
    """A content type or a file that no reader here understands."""

    def __init__(self, name: str, value: object, allowed: str | None = None) -> None:
        types = ", ".join((*CONTENT_TYPES, *UNSPECIFIC_TYPES))
        super().__init__(name, value, allowed or f"{types} (docs/formats.md)")


class UnusedSetting(InvalidInput):
    """A setting given with a format that has no use for it."""


def read(path: Path | str, content_type: str | None = None, **settings: float | str | Path | None) -> GraspLog:
    """Read a grasp log of any known format: a file, or the folder of a Tac3D or rosbag2 recording or, with
    the episode in the mapping, of a LeRobot data set.

    The format is what ``content_type`` names or, without one, what the file's content gives. ``settings``, where they
    are not None: of tracked markers ``scale`` (m per pixel) and ``frame_rate`` (1/s), of formats with topics, fields or
    columns the ``mapping`` (JSON); of both ``rest``, the frame at rest by the words of ``rest.py``, or a ``Path`` to a
    recording of the sensor alone in the same format. Raises ``UnsupportedFormat``, or ``InvalidInput`` for what is
    wrong inside.
    """
    path = Path(path)
    name = identify(path, content_type, settings)
    check_settings(name, settings)
    given: dict[str, Any] = {key: value for key, value in settings.items() if value is not None}
    if "mapping" in given:
        given["mapping"] = parse_mapping(settings)
    if isinstance(chosen := given.get("rest"), Path) and chosen.is_dir() and name not in IN_FOLDERS:
        raise InvalidInput("rest", f"the folder {chosen}", f"a file, as of any {name}")
    if "rest" not in given or name == "tracked markers":
        return _reader(name)(path, **given)
    return _read_from_rest(_reader(name), path, given)


def _read_from_rest(reader: Callable[..., GraspLog], path: Path, given: dict[str, Any]) -> GraspLog:
    """A log of a format that takes a mapping, with displacement from the frame or the file that is at ``rest``."""
    chosen, mapping = given.pop("rest"), given.get("mapping", mappings.UNMAPPED)
    if not isinstance(chosen, Path):
        return reader(path, **{**given, "mapping": mapping.at_rest(rest.check(chosen))})
    alone = reader(chosen, **{**given, "mapping": mapping.at_rest(rest.ALL_FRAMES)})
    return reader(path, **{**given, "mapping": mapping.at_rest(rest.SensorAlone.of(alone, chosen.name))})


def episodes_of(folder: Path, mapping: str | None = None) -> list[int]:
    """Numbers of the episodes of a LeRobot data set, or the one that the mapping names; raises ``InvalidInput``."""
    parsed = parse_mapping({"mapping": mapping})
    return [episode.number for episode in module_of("parquet").lerobot.episodes(folder, parsed)]


def check_settings(name: str, settings: Settings) -> None:
    """Raises ``UnusedSetting`` for one, or for an entry of the mapping, that the format does not take."""
    for key, value in settings.items():
        if value is not None and key not in FORMATS[name].settings:
            raise UnusedSetting(key, f"{str(value)[:60]} with {name}", _WHERE[key])
    mapping = parse_mapping(settings)
    for key, entry in () if mapping is None or mapping.preset else mapping.particular_entries.items():
        if key not in FORMATS[name].entries:
            raise UnusedSetting(f"mapping {key}", f"{str(entry)[:60]} with {name}", _WHERE_IN_MAPPING[key])


def parse_mapping(settings: Settings) -> mappings.FieldMapping | None:
    """The mapping among the settings, which are checked; raises ``InvalidInput``."""
    if isinstance(chosen := settings.get("rest"), str):
        rest.check(chosen)
    text = settings.get("mapping")
    return None if text is None else mappings.parse(str(text))


def identify(path: Path, content_type: str | None = None, settings: Settings = NO_SETTINGS) -> str:
    """Name of the format of the log at ``path``, a key of ``FORMATS``; raises ``UnsupportedFormat``.

    Delimited text is a table of tracked markers, or one of frames where the ``settings`` have a mapping.
    """
    is_mapped = settings.get("mapping") is not None
    media_type = (content_type or UNSPECIFIC_TYPES[0]).partition(";")[0].strip().lower()
    if media_type in CONTENT_TYPES:
        name = CONTENT_TYPES[media_type]
        return "frame table" if is_mapped and name == "tracked markers" else name
    if media_type not in UNSPECIFIC_TYPES:
        raise UnsupportedFormat("content type", media_type[:100])
    return _sniff_folder(path) if path.is_dir() else _sniff(path, is_mapped)


def check_start(path: Path, name: str) -> None:
    """Raises ``InvalidInput`` for a file that does not begin as its format does: no reader need look at it."""
    magic = FORMATS[name].magic if FORMATS[name].leads else b""
    with path.open("rb") as stream:
        start = stream.read(max(len(magic), len(ZIP)))
    if not start.startswith((magic, ZIP) if name == "rosbag2" else magic):  # its folder may be zipped
        raise InvalidInput("file", f"no {name} (it starts with {start[:8]!r})", f"a file that starts with {magic!r}")


def module_of(name: str) -> ModuleType:
    """The module of a format, imported only now, with its library; ``UnsupportedFormat`` where that is missing."""
    allowed = f"the extra `{EXTRA}`, which brings it: pip install 'stiction[{EXTRA}]'"
    return import_with_library(f"service.formats.{FORMATS[name].reader.partition('.')[0]}", name, allowed)


def import_with_library(module: str, name: str, install: str) -> ModuleType:
    """A module of ours that needs a library; ``UnsupportedFormat`` naming what needs it, and what installs it, where
    that is missing.
    """
    try:
        return importlib.import_module(module)
    except ModuleNotFoundError as error:
        if str(error.name).startswith("service"):
            raise
        raise UnsupportedFormat(f"library of {name}", f"{error.name}, which is not installed", install) from error


def _reader(name: str) -> Callable[..., GraspLog]:
    reader: Callable[..., GraspLog] = getattr(module_of(name), FORMATS[name].reader.partition(".")[2])
    return reader


def _sniff_folder(path: Path) -> str:
    if (path / LEROBOT_INFO).is_file():
        return "parquet"
    return "rosbag2" if any(file.suffix in STORAGE for file in path.iterdir()) else "tac3d"


def _sniff(path: Path, is_mapped: bool) -> str:
    with path.open("rb") as stream:
        start = stream.read(SNIFFED_BYTES)
    for name, each in FORMATS.items():
        if each.magic and start.startswith(each.magic):
            return name
    if start.startswith(ZIP):
        return _sniff_zip(path)
    if start.lstrip(b"\xef\xbb\xbf \t\r\n").startswith(b"{"):
        return "json"
    if not is_mapped and tracked_markers.looks_like(start):
        return "tracked markers"
    if frame_table.looks_like(start):
        if is_mapped:
            return "frame table"
        header = start.splitlines()[0].decode("utf-8", "replace")
        allowed = presets.instead(split_header(header)[0], TABLES)
        raise UnsupportedFormat("file", f"a table that begins with {header[:60]!r}", allowed)
    if not start:
        raise UnsupportedFormat("file", "empty", KNOWN)
    raise UnsupportedFormat("file", f"of no known format (it starts with {start[:4]!r})", KNOWN)


def _sniff_zip(path: Path) -> str:
    with open_archive(path) as archive:
        names = archive.namelist()
    if "format.npy" in names:
        return "npz"
    if any(PurePosixPath(name).stem in tac3d.REQUIRED for name in names):
        return "tac3d"
    if any(PurePosixPath(name).suffix in STORAGE for name in names):
        return "rosbag2"
    raise UnsupportedFormat("file", f"a zip of {', '.join(names)[:100] or 'nothing'}")
