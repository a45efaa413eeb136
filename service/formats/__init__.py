"""File formats of grasp logs, one module each."""

from pathlib import Path, PurePosixPath

from service.formats import npz, tac3d, tracked_markers
from service.formats.archive import open_archive
from slipcore.errors import InvalidInput
from slipcore.frames import GraspLog

__all__ = ["CONTENT_TYPES", "UnsupportedFormat", "identify", "read"]

CONTENT_TYPES = {
    "application/vnd.stiction.grasp-log+npz": "npz",
    "application/vnd.tac3d+zip": "tac3d",
    "text/csv": "tracked markers",
}
"""Content types that name a format; the others below leave it to the file's own content."""

UNSPECIFIC_TYPES = ("application/zip", "application/octet-stream")

SNIFFED_BYTES = 4096
"""Enough for the lines before a table and its header."""

_READERS = {"npz": npz.read, "tac3d": tac3d.read}


class UnsupportedFormat(InvalidInput):
    """A content type or a file that no reader here understands."""

    def __init__(self, name: str, value: object, allowed: str | None = None) -> None:
        types = ", ".join((*CONTENT_TYPES, *UNSPECIFIC_TYPES))
        accepted = f"{types}; a Stiction NPZ, a zipped Tac3D recording or a table of tracked markers"
        super().__init__(name, value, allowed or accepted)


def read(path: Path, content_type: str | None = None, **settings: float | None) -> GraspLog:
    """Read a grasp log of any known format: an NPZ container, a Tac3D recording folder or a zip of one, or a table of
    tracked markers, whose ``scale`` (m per pixel) and ``frame_rate`` (1/s) may be given as ``settings``.

    The format is what ``content_type`` names or, without one, what the file's content tells. Raises
    ``UnsupportedFormat``, or ``InvalidInput`` for what is wrong inside.
    """
    name = identify(path, content_type)
    given = {key: value for key, value in settings.items() if value is not None}
    if name == "tracked markers":
        return tracked_markers.read(path, **given)
    for key, value in given.items():
        raise InvalidInput(key, value, "only beside a table of tracked markers: other formats are in SI units")
    return _READERS[name](path)


def identify(path: Path, content_type: str | None = None) -> str:
    """Name of the format of the log at ``path``: "npz", "tac3d" or "tracked markers"; raises ``UnsupportedFormat``."""
    media_type = (content_type or UNSPECIFIC_TYPES[0]).partition(";")[0].strip().lower()
    if media_type in CONTENT_TYPES:
        return CONTENT_TYPES[media_type]
    if media_type not in UNSPECIFIC_TYPES:
        raise UnsupportedFormat("content type", media_type[:100])
    return "tac3d" if path.is_dir() else _sniff(path)


def _sniff(path: Path) -> str:
    with path.open("rb") as stream:
        start = stream.read(SNIFFED_BYTES)
    if not start.startswith(b"PK\x03\x04"):
        if tracked_markers.looks_like(start):
            return "tracked markers"
        value = f"neither a zip nor a table of markers (it starts with {start[:4]!r})" if start else "empty"
        raise UnsupportedFormat("file", value)
    with open_archive(path) as archive:
        names = archive.namelist()
    if "format.npy" in names:
        return "npz"
    if any(PurePosixPath(name).stem in tac3d.REQUIRED for name in names):
        return "tac3d"
    raise UnsupportedFormat("file", f"a zip of {', '.join(names)[:100] or 'nothing'}")
