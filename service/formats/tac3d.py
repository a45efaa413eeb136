"""Tac3D recordings: a folder with one .npy a field, in mm and N, or that folder zipped (docs/formats.md)."""

import math
from collections.abc import Mapping
from pathlib import Path, PurePosixPath
from typing import Any

import numpy as np
from numpy.typing import NDArray

from service.formats.archive import open_archive, read_member
from service.formats.lattice import element_area
from service.formats.npy import MAX_ARRAY_BYTES, read_array
from slipcore.errors import InvalidInput
from slipcore.frames import UNNAMED, FloatArray, GraspLog

REQUIRED = ("3D_Positions", "3D_Displacements", "index", "sendTimestamp")
OPTIONAL = ("3D_Forces", "3D_Normals")

MILLIMETRE = 1e-3

REST_TOLERANCE = 1e-4
"""m; a tenth of the marker pitch. In the recordings that ship with the sensor's software it is 0.7 µm at most."""

LARGEST = 2.0**53
"""Of counters and clocks: up to there each whole number is a number of its own."""

Fields = Mapping[str, NDArray[Any]]


def read(path: Path) -> GraspLog:
    """Read a recording from its folder or from a zip of it. Raises ``InvalidInput`` naming the field that is wrong."""
    sensor, fields = _from_folder(path) if path.is_dir() else _from_zip(path)
    missing = [name for name in REQUIRED if name not in fields]
    if missing:
        raise InvalidInput("fields", f"without {', '.join(missing)}", f"{', '.join(REQUIRED)} as .npy each")
    vectors = {name: _lattice(name, fields[name]) for name in fields if name.startswith("3D_")}
    index = _clock("index", fields["index"])
    time = _clock("sendTimestamp", fields["sendTimestamp"])
    _check_frame_counts(vectors | {"index": index, "sendTimestamp": time})
    displacement = vectors["3D_Displacements"] * MILLIMETRE
    position, metadata = _rest(vectors["3D_Positions"] * MILLIMETRE, displacement)
    return GraspLog(
        time=time - time[0],
        position=position,
        displacement=displacement,
        element_area=element_area("3D_Positions", position),
        force=vectors.get("3D_Forces"),
        normal=vectors.get("3D_Normals"),
        sensor=sensor,
        metadata=metadata | _frame_counts(index, time),
    )


def _from_folder(folder: Path) -> tuple[str, Fields]:
    paths = {name: folder / f"{name}.npy" for name in (*REQUIRED, *OPTIONAL)}
    present = {name: path for name, path in paths.items() if path.is_file()}
    total = sum(path.stat().st_size for path in present.values())
    if total > MAX_ARRAY_BYTES:
        raise InvalidInput("folder", f"{total} bytes", f"at most {MAX_ARRAY_BYTES} bytes")
    return folder.resolve().name, {name: _read_file(path, name) for name, path in present.items()}


def _read_file(path: Path, name: str) -> NDArray[Any]:
    with path.open("rb") as stream:
        return read_array(stream, name, path.stat().st_size)


def _from_zip(path: Path) -> tuple[str, Fields]:
    with open_archive(path) as archive:
        members = [PurePosixPath(name) for name in archive.namelist() if not name.startswith("__MACOSX/")]
        wanted = [member for member in members if member.suffix == ".npy" and member.stem in (*REQUIRED, *OPTIONAL)]
        folders = sorted({str(member.parent) for member in wanted})
        if len(folders) > 1:
            raise InvalidInput(
                "file", f"a zip of {len(folders)} recordings ({', '.join(folders)[:200]})", "one recording"
            )
        fields = {member.stem: read_member(archive, str(member), member.stem) for member in wanted}
    name = PurePosixPath(folders[0]).name if folders else ""
    return name or UNNAMED, fields


def _lattice(name: str, array: NDArray[Any]) -> FloatArray:
    """A field as [t, n, n, 3] from [t, n², 3]; all Tac3D lattices are square and row-major."""
    side = math.isqrt(array.shape[1]) if array.ndim == 3 else 0
    if array.dtype.kind != "f" or array.ndim != 3 or array.shape[1:] != (side * side, 3) or array.size == 0:
        value = f"{array.dtype} of shape {list(array.shape)}"
        raise InvalidInput(
            name, value, "floating point numbers of shape [frames, markers, 3], a square number of markers"
        )
    return array.reshape(len(array), side, side, 3).astype(np.float64)


def _clock(name: str, array: NDArray[Any]) -> FloatArray:
    """A frame counter or clock, strictly increasing: [t]."""
    allowed = "one strictly increasing number a frame"
    if array.dtype.kind not in "iuf" or array.ndim == 0 or array.size != len(array) or array.size == 0:
        raise InvalidInput(name, f"{array.dtype} of shape {list(array.shape)}", allowed)
    with np.errstate(over="ignore"):  # of numbers longer than these
        values = array.reshape(-1).astype(np.float64)
    beyond = np.flatnonzero(~(np.abs(values) <= LARGEST))
    if beyond.size:
        frame = int(beyond[0])
        raise InvalidInput(name, f"{values[frame]:.15g} at frame {frame}", f"{allowed}, within ±2⁵³")
    wrong = np.flatnonzero(~(np.diff(values) > 0.0))
    if wrong.size:
        frame = int(wrong[0]) + 1
        raise InvalidInput(name, f"{values[frame]:.15g} at frame {frame}, after {values[frame - 1]:.15g}", allowed)
    return values


def _check_frame_counts(fields: Mapping[str, FloatArray]) -> None:
    counts = {name: len(array) for name, array in fields.items()}
    if len(set(counts.values())) > 1:
        raise InvalidInput(
            "frames", ", ".join(f"{count} in {name}" for name, count in counts.items()), "one number of frames"
        )


def _rest(position: FloatArray, displacement: FloatArray) -> tuple[FloatArray, dict[str, str]]:
    """Rest shape [n, n, 3] m, and what was seen of it.

    ``3D_Positions`` is the measured surface. In contact ``3D_Displacements`` is its distance from one rest shape; out
    of contact the sensor's software sets displacement and force to exactly 0 while the measured surface keeps its
    noise, so only frames in contact show the rest shape (all frames, where there is no contact at all).
    """
    _check_finite("3D_Positions", position)
    _check_finite("3D_Displacements", displacement)
    gated = ~displacement.any(axis=(1, 2, 3))
    candidates = position - displacement if gated.all() else (position - displacement)[~gated]
    rest = np.median(candidates, axis=0)
    spread = float(np.abs(candidates - rest).max())
    if spread > REST_TOLERANCE:
        value = f"off one rest shape by up to {spread:.3g} m"
        raise InvalidInput(
            "3D_Positions - 3D_Displacements", value, f"at most {REST_TOLERANCE:g} m (recalibrated midway?)"
        )
    return rest, {"gated_frames": str(int(gated.sum())), "rest_spread": f"{spread:.3g} m"}


def _check_finite(name: str, array: FloatArray) -> None:
    bad = np.argwhere(~np.isfinite(array))
    if len(bad):
        raise InvalidInput(
            name, f"{array[tuple(bad[0])]} at index {bad[0].tolist()} ({len(bad)} in all)", "finite numbers"
        )


def _frame_counts(index: FloatArray, time: FloatArray) -> dict[str, str]:
    dropped = int(index[-1] - index[0]) + 1 - len(index)
    return {
        "format": "tac3d",
        "first_index": f"{index[0]:.0f}",
        "dropped_frames": str(dropped),
        "largest_gap": f"{np.diff(time).max(initial=0.0):.6g} s",
        "start_time": f"{time[0]:.9f} s",
    }
