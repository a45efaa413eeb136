"""Tracked markers as text: one row a marker and frame, in pixels or metres (docs/formats.md)."""

import math
from array import array
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from service.formats import presets
from service.formats import rest as rests
from service.formats.delimited import parse_number, rows, split_header, text_lines
from service.formats.npy import MAX_ARRAY_BYTES
from slipcore.defaults import LIMITS
from slipcore.errors import InvalidInput
from slipcore.frames import BY_MOTION, UNNAMED, BoolArray, FloatArray, GraspLog

ALIASES = {
    "time": "time", "frame": "frame", "marker": "marker", "particle": "marker", "id": "marker", "track_id": "marker",
    "x": "x", "y": "y", "z": "z", "contact": "contact", "gripper_force": "gripper_force",
    "frameno": "frame", "cx": "x", "cy": "y", "row": "row", "col": "col",
    "fx": "fx", "fy": "fy", "fz": "fz", "force_x": "fx", "force_y": "fy", "force_z": "fz",
}  # fmt: skip
"""Columns that are read, by the names that they may have."""
FORCE = ("fx", "fy", "fz")
SETTINGS = ("scale", "frame_rate", "sensor", "gripper_force_deviation", "rest")
"""What lines before the header may state: ``# scale: 2.5e-5``."""
SCALE, FRAME_RATE = (1e-9, 1.0), (1e-3, 1e6)
"""m per pixel (1 where the file is in metres) and frames a second that can be."""
ASSUMED_WIDTH = 15e-3
"""m that the markers span where their scale is unknown: a fingertip's sensor. Detection depends on it a little."""
COUNTS_FRAMES = "1/s, because the file counts frames (--frame-rate 30, or a line `# frame_rate: 30` before its header)"
"""What is said where a rate is missing."""
MAX_ROWS, ROW = 5_000_000, 11
"""Rows of a file, and numbers that are kept of each."""


@dataclass(frozen=True, slots=True)
class Header:
    """What stands before the rows: ``settings``, the column of each quantity, and what is left unread."""

    settings: Mapping[str, str]
    columns: Mapping[str, int]
    width: int
    delimiter: str
    ignored: tuple[str, ...]
    lines: int


@dataclass(frozen=True, slots=True)
class Tracks:
    """Markers over time: ``names`` [k], ``time`` [t] s, ``place`` [t, k, 3] as in the file (NaN where lost),
    ``contact`` [t, k], ``force`` [t, k, 3] N, ``gripper_force`` [t] N.
    """

    names: tuple[str, ...]
    time: FloatArray
    place: FloatArray
    force: FloatArray | None
    contact: BoolArray | None
    has_height: bool
    gripper_force: FloatArray | None


def read(
    path: Path, scale: float | None = None, frame_rate: float | None = None, rest: str | Path | None = None
) -> GraspLog:
    """Read a file of tracked markers; ``scale`` (m per pixel), ``frame_rate`` (1/s) and ``rest`` (of ``rest.py``'s
    words, or a file of the same markers at rest) go before what the file says.

    Raises ``InvalidInput`` naming the line and the value that is wrong.
    """
    given = {name: repr(value) for name, value in (("scale", scale), ("frame_rate", frame_rate)) if value is not None}
    if isinstance(rest, Path):
        return read_lines(text_lines(path), given, at_rest(rest, given))
    return read_lines(text_lines(path), given if rest is None else {**given, "rest": rest})


def read_lines(
    lines: Iterator[str],
    given: Mapping[str, str] = MappingProxyType({}),
    places: Mapping[str, FloatArray] | None = None,
) -> GraspLog:
    """Read a file's lines, with what is ``given`` in place of the settings in it, and ``places`` at rest [3] by
    the markers' names, in the file's unit, in place of a frame.
    """
    header = read_header(lines)
    settings = {**header.settings, **given}
    return _grasp_log(_tracks(header, lines, settings), settings, header.ignored, places)


def at_rest(path: Path, given: Mapping[str, str] = MappingProxyType({})) -> dict[str, FloatArray]:
    """Median place [3] of each marker of a file that shows the sensor alone, in the file's unit."""
    lines = text_lines(path)
    header = read_header(lines)
    tracks = _tracks(header, lines, {"frame_rate": "1", **header.settings, **given})  # times play no part
    seen = np.isfinite(tracks.place).all(axis=2).any(axis=0)
    return {tracks.names[k]: np.nanmedian(tracks.place[:, k], axis=0) for k in np.flatnonzero(seen)}


def write(path: Path, place: FloatArray, frame_rate: float | None = None) -> None:
    """Write a table of markers that were tracked in the plane: ``place`` [t, k, 2] px, NaN where lost, and the
    ``frame_rate`` (1/s) where it is known.
    """
    with path.open("w", encoding="utf-8") as file:
        if frame_rate is not None:
            file.write(f"# frame_rate: {frame_rate!r}\n")
        file.write("frame,marker,x,y\n")
        for frame, row in enumerate(place.tolist()):
            file.writelines(f"{frame},{marker},{x:.4f},{y:.4f}\n" for marker, (x, y) in enumerate(row))


class RepeatedSetting(InvalidInput):
    """A setting that stands twice before the header."""


def looks_like(start: bytes) -> bool:
    """Whether a file that begins so has a header of tracked markers."""
    try:
        lines = start.decode("utf-8", errors="ignore").splitlines()
        read_header(iter(lines))
    except RepeatedSetting:
        return True
    except InvalidInput:
        return False
    return True


def read_header(lines: Iterator[str]) -> Header:
    """Settings and column names; the lines after them stay in the iterator."""
    settings: dict[str, str] = {}
    for number, line in enumerate(lines, start=1):
        text = line.strip("\ufeff \r\n")
        if text.startswith("#"):
            name, _, value = (part.strip() for part in text[1:].partition(":"))
            name = name.lower()
            if name in settings:
                raise RepeatedSetting(f"line {number}, {name}", "a second time", "each setting once")
            if name in SETTINGS:
                settings[name] = value
        elif text:
            return _columns(text, settings, number)
    raise InvalidInput("file", "without a header", "a line that names the columns: time or frame, marker, x, y")


def _columns(text: str, settings: Mapping[str, str], number: int) -> Header:
    names, delimiter = split_header(text.lower())
    columns: dict[str, int] = {}
    for place, name in enumerate(names):
        if name in ALIASES and ALIASES[name] in columns:
            raise InvalidInput(f"line {number}", f"two columns of {ALIASES[name]}", "one of each")
        if name in ALIASES:
            columns[ALIASES[name]] = place
    if "marker" in columns or not columns.keys() >= {"row", "col"}:  # which else name the marker
        columns = {name: place for name, place in columns.items() if name not in ("row", "col")}
    elif columns.keys() >= {"row", "col"}:
        columns["marker"] = columns["row"]
    missing = [name for name in ("marker", "x", "y") if name not in columns]
    if not {"time", "frame"} & columns.keys():
        missing.insert(0, "time or frame")
    if missing:
        value = f"a header without {', '.join(missing)} ({text[:60]!r})"
        columns_taken = "columns time or frame, marker, x, y; optional z, contact, fx with fy and fz, gripper_force"
        raise InvalidInput(f"line {number}", value, presets.instead(names, columns_taken))
    if not columns.keys() >= set(FORCE):  # friction needs all three
        columns = {name: place for name, place in columns.items() if name not in FORCE}
    ignored = tuple(name for name in names if ALIASES.get(name) not in columns)
    return Header(settings, columns, len(names), delimiter, ignored, number)


def _tracks(header: Header, lines: Iterator[str], settings: Mapping[str, str]) -> Tracks:
    """All rows, sorted into frames and markers."""
    table, names = _table(header, lines)
    moment, line = table[:, 0], table[:, -1]
    if "time" not in header.columns:
        moment = moment / _setting("frame_rate", settings, FRAME_RATE, COUNTS_FRAMES)
    time, frame = np.unique(moment, return_inverse=True)
    marker = table[:, 1].astype(np.intp)
    _check_size(len(time), len(names))
    _check_once(frame * len(names) + marker, line, names, marker)
    place = np.full((len(time), len(names), 3), np.nan)
    place[frame, marker] = table[:, 2:5]
    contact = None
    if "contact" in header.columns:
        contact = _held(frame, marker, table[:, 5], place.shape[:2])
    gripper_force = _one_a_frame(frame, table[:, 6], line) if "gripper_force" in header.columns else None
    force = None
    if header.columns.keys() >= set(FORCE):
        force = np.full(place.shape, np.nan)
        force[frame, marker] = table[:, 7:10]
        force = _last_stated(force)
    return Tracks(tuple(names), time, place, force, contact, "z" in header.columns, gripper_force)


def _table(header: Header, lines: Iterator[str]) -> tuple[FloatArray, dict[str, int]]:
    """Rows [r, 11] of moment, marker (its number), x, y, z, contact, gripper's force, force along x, y and z, line; and
    the markers by name.
    """
    names: dict[str, int] = {}
    values = array("d")  # a list of tuples would take five times the memory
    for line, cells in rows(lines, header.delimiter, header.width, header.lines, MAX_ROWS):
        values.extend(_row(header, cells, line, names))
    if not values:
        raise InvalidInput("file", "a header without rows", "one row a marker and frame")
    return np.frombuffer(values).reshape(-1, ROW), names


def _row(header: Header, cells: list[str], line: int, names: dict[str, int]) -> tuple[float, ...]:
    text = {name: cells[place].strip() for name, place in header.columns.items()}
    key = "time" if "time" in text else "frame"
    moment = parse_number(text[key], line, key)
    if math.isnan(moment):
        raise InvalidInput(f"line {line}, {key}", repr(text[key])[:40], "a finite number")
    if not text["marker"]:
        raise InvalidInput(f"line {line}, marker", "empty", "a name or number")
    name = f"{text['row']}, {text['col']}" if "row" in text else text["marker"]
    marker = names.setdefault(name, len(names))
    x, y = parse_number(text["x"], line, "x"), parse_number(text["y"], line, "y")
    z = parse_number(text["z"], line, "z") if "z" in text else 0.0
    touching = parse_number(text["contact"], line, "contact") if "contact" in text else 1.0
    if touching not in (0.0, 1.0) and not math.isnan(touching):
        raise InvalidInput(f"line {line}, contact", repr(text["contact"])[:40], "0 or 1, empty where unknown")
    gripper = parse_number(text["gripper_force"], line, "gripper_force") if "gripper_force" in text else math.nan
    force = (parse_number(text[name], line, name) if name in text else math.nan for name in FORCE)
    return moment, marker, x, y, z, touching, gripper, *force, line


def _setting(name: str, settings: Mapping[str, str], limits: tuple[float, float], unit: str) -> float:
    low, high = limits
    text = settings.get(name, "")
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not low <= value <= high:
        raise InvalidInput(name, repr(text)[:40] if text else "missing", f"{low:g} to {high:g} {unit}")
    return value


def _check_size(frames: int, markers: int) -> None:
    claimed = frames * markers * 3 * 8
    if claimed > MAX_ARRAY_BYTES:
        raise InvalidInput("file", f"{frames} frames of {markers} markers", f"at most {MAX_ARRAY_BYTES} bytes of them")


def _check_once(
    places: NDArray[np.intp], lines: FloatArray, names: Mapping[str, int], marker: NDArray[np.intp]
) -> None:
    """No marker twice in a frame."""
    order = np.argsort(places, kind="stable")
    twice = np.flatnonzero(np.diff(places[order]) == 0)
    if twice.size:
        row = int(order[twice[0] + 1])
        name = list(names)[int(marker[row])]
        raise InvalidInput(f"line {lines[row]:.0f}", f"marker {name[:40]!r} again in one frame", "each marker once")


def _one_a_frame(frame: NDArray[np.intp], column: FloatArray, lines: FloatArray) -> FloatArray:
    """What the rows of each frame state alike, or one of them states [t]; raises ``InvalidInput`` where none does."""
    values = np.full(int(frame.max()) + 1, np.nan)
    rows_stating = np.flatnonzero(np.isfinite(column))
    values[frame[rows_stating[::-1]]] = column[rows_stating[::-1]]
    other = rows_stating[column[rows_stating] != values[frame[rows_stating]]]
    if other.size:
        place = f"line {lines[other[0]]:.0f}, gripper_force"
        raise InvalidInput(
            place, f"{column[other[0]]:g} N", f"{values[frame[other[0]]]:g} N, as in the frame's other rows"
        )
    unknown = np.flatnonzero(np.isnan(values))
    if unknown.size:
        raise InvalidInput("gripper_force", f"missing in frame {unknown[0]}", "a number of N in a row of each frame")
    return values


def _held(frame: NDArray[np.intp], marker: NDArray[np.intp], touching: FloatArray, shape: tuple[int, int]) -> BoolArray:
    """Contact [t, k]; where it isn't given, as it was given last, at first none."""
    stated = np.full((*shape, 1), np.nan)
    stated[frame, marker, 0] = touching
    held: BoolArray = _last_stated(stated)[..., 0] == 1.0
    return held


def _last_stated(stated: FloatArray) -> FloatArray:
    """Numbers [t, k, c] as they were given last, at first 0."""
    frames = np.arange(len(stated))[:, None, None]
    last = np.maximum.accumulate(np.where(np.isnan(stated), 0, frames), axis=0)
    return np.nan_to_num(np.take_along_axis(stated, last, axis=0), nan=0.0)


def _grasp_log(
    tracks: Tracks,
    settings: Mapping[str, str],
    ignored: tuple[str, ...],
    places: Mapping[str, FloatArray] | None,
) -> GraspLog:
    """The log in metres, from the markers whose place at rest is known."""
    at, where = _rest(tracks, settings.get("rest", rests.FIRST), places)
    known: BoolArray = np.asarray(np.isfinite(at).all(axis=1))
    if not known.any():
        raise InvalidInput(where, "without any marker of the log", f"markers at rest in the {where}")
    at, place, metadata = at[known], tracks.place[:, known], _metadata(tracks, known, ignored, where)
    if "scale" in settings:
        scale = _setting("scale", settings, SCALE, "m per pixel")
        metadata["scale"] = f"{scale:g} m per pixel"
        _check_extent(at, scale)
    else:
        scale = ASSUMED_WIDTH / max(float(np.ptp(at[:, :2], axis=0).max()), 1e-300)
        metadata |= {"scale": "unknown", "assumed_scale": f"{scale:.6g} m per pixel"}
    from slipcore.markers import (
        contact_by_motion,
        on_lattice,
    )  # loads scipy.spatial, which whoever only looks what a file is does without

    contact = tracks.contact
    unseen = contact is None and not tracks.has_height and tracks.force is None
    log, lattice = on_lattice(
        tracks.time,
        scale * at,
        scale * (place - at),
        None if contact is None else contact[:, known],
        settings.get("sensor", UNNAMED),
        metadata,
    )
    if tracks.force is not None:  # an element without a marker of its own bears none, or a force would count twice
        own = lattice.occupied[..., None]
        log = replace(log, force=np.where(own, tracks.force[:, known][:, lattice.marker], 0.0))
    if unseen:
        metadata = {**log.metadata, "contact": BY_MOTION}
        log = replace(log, contact=contact_by_motion(log.time, log.displacement), metadata=metadata)
    return _with_gripper(log, tracks.gripper_force, settings)


def _check_extent(at: FloatArray, scale: float) -> None:
    """Most who give mm in place of m are refused so: their sensor would be as large as a room."""
    extent = scale * float(np.abs(at).max())
    if extent > LIMITS.position:
        wrong = f"{scale:g} m per pixel, by which markers lie up to {extent:.3g} m from the origin"
        raise InvalidInput("scale", wrong, f"one by which they lie within {LIMITS.position:g} m (is it in m?)")


def _rest(tracks: Tracks, chosen: str, places: Mapping[str, FloatArray] | None) -> tuple[FloatArray, str]:
    """Places [k, 3] at rest, NaN where unknown, and where they are from."""
    if places is not None:
        unknown = np.full(3, np.nan)
        return np.array([places.get(name, unknown) for name in tracks.names]), "file of rest"
    members = {"contact": tracks.contact, "force": tracks.force, "gripper_force": tracks.gripper_force}
    load = rests.load_of({name: value for name, value in members.items() if value is not None})
    frame = rests.frame_of(chosen, len(tracks.time), load, tracks.place)
    return tracks.place[frame], f"frame {frame}" if frame else "first frame"


def _with_gripper(log: GraspLog, force: FloatArray | None, settings: Mapping[str, str]) -> GraspLog:
    """The log with what the gripper reported, if it did."""
    name, deviation = "gripper_force_deviation", None
    if name in settings:
        deviation = _setting(name, settings, (0.0, LIMITS.gripper_force), "N")
    return replace(log, gripper_force=force, gripper_force_deviation=deviation)


def _metadata(tracks: Tracks, known: BoolArray, ignored: tuple[str, ...], where: str) -> dict[str, Any]:
    lost = int(np.isnan(tracks.place[:, known, 0] + tracks.place[:, known, 1]).sum())
    metadata = {"format": "tracked markers", "markers": str(int(known.sum())), "lost_places": str(lost)}
    left_out = int(len(known) - known.sum())
    if left_out:
        metadata["markers_left_out"] = f"{left_out} (not in the {where})"
    if where != "first frame":
        metadata["rest"] = where
    if ignored:
        metadata["columns_left_out"] = ", ".join(ignored)[:200]
    return metadata
