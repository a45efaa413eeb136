"""The NPZ container of a grasp log, as bytes that are the same for the same log (docs/formats.md)."""

import io
import json
import zipfile
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import IO, Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from stiction_client.errors import InvalidArgument

FORMAT, VERSION = "stiction-grasp-log", 1
CONTENT_TYPE = "application/vnd.stiction.grasp-log+npz"
RECORDING_TYPE = "application/vnd.tac3d+zip"
EPOCH = (1980, 1, 1, 0, 0, 0)
"""The earliest time a zip can hold; a real clock would make two copies of one log differ."""

FLOAT32_ALLOWED = {"displacement", "force", "normal"}
MASKS = ("contact", "observed")
GRIPPER = ("gripper_force", "gripper_force_deviation")
"""Optional, as masks are: a log that was made before there were any need not have them."""


class GraspLogLike(Protocol):
    """What a log needs to be written: the fields of ``slipcore.GraspLog``, which this package doesn't import."""

    @property
    def time(self) -> ArrayLike:
        """[t] s."""

    @property
    def position(self) -> ArrayLike:
        """[n, m, 3] m, at rest."""

    @property
    def displacement(self) -> ArrayLike:
        """[t, n, m, 3] m."""

    @property
    def element_area(self) -> float:
        """m²."""

    @property
    def force(self) -> ArrayLike | None:
        """[t, n, m, 3] N."""

    @property
    def normal(self) -> ArrayLike | None:
        """[t, n, m, 3], unit vectors."""

    @property
    def object_pose(self) -> ArrayLike | None:
        """[t, 3] m, m, rad."""

    @property
    def sensor(self) -> str:
        """Name of the sensor."""

    @property
    def metadata(self) -> Mapping[str, str]:
        """Whatever else is known."""

    @property
    def truth(self) -> Any:
        """A simulator's ground truth, or None."""


def encode(log: GraspLogLike) -> bytes:
    """A grasp log as an NPZ container: a zip of .npy members without compression, clock or pickles.

    Equal logs give equal bytes on every machine, so that a content hash finds duplicates (deflate would depend on
    the compressor's version). float32 is kept for displacement, force and normal; all else is float64.
    """
    buffer = io.BytesIO()
    _zip(buffer, _npy_members(log))
    return buffer.getvalue()


def write(log: GraspLogLike, path: Path | str) -> Path:
    """Write a grasp log to ``path`` as an NPZ container and return the path."""
    target = Path(path)
    with target.open("wb") as stream:
        _zip(stream, _npy_members(log))
    return target


def pack_folder(folder: Path | str) -> bytes:
    """A recording folder (one .npy a field) as a zip, the same bytes for the same recording.

    Raises ``InvalidArgument`` where the folder holds no .npy file.
    """
    source = Path(folder).resolve()
    paths = sorted(source.glob("*.npy"))
    if not paths:
        raise InvalidArgument("folder", f"{source.name!r} without .npy files", "a recording, one .npy a field")
    buffer = io.BytesIO()
    _zip(buffer, ((f"{source.name}/{path.name}", path.read_bytes()) for path in paths))
    return buffer.getvalue()


def members(log: GraspLogLike) -> dict[str, NDArray[Any]]:
    """The arrays that a container of this log holds, by name; optional ones that the log lacks are left out."""
    arrays: dict[str, NDArray[Any]] = {
        "format": np.array(FORMAT),
        "version": np.array(VERSION, dtype="<i8"),
        "sensor": np.array(str(log.sensor)),
        "metadata": np.array(json.dumps(dict(log.metadata), sort_keys=True)),
    }
    for name in ("time", "position", "displacement", "element_area", "force", "normal", "object_pose"):
        value = getattr(log, name)
        if value is not None:
            arrays[name] = _real(name, value)
    for name in GRIPPER:
        value = getattr(log, name, None)
        if value is not None:
            arrays[name] = _real(name, value)
    for name in MASKS:
        mask = getattr(log, name, None)
        if mask is not None:
            arrays[name] = np.ascontiguousarray(mask, dtype=np.bool_)
    return arrays if log.truth is None else arrays | _truth(log.truth)


def _truth(truth: Any) -> dict[str, NDArray[Any]]:
    masks = ("contact", "slip_kinematic", "slip_contact_factor")
    return {
        **{f"truth_{name}": np.ascontiguousarray(getattr(truth, name), dtype=np.bool_) for name in masks},
        "truth_stick_ratio": _real("truth_stick_ratio", truth.stick_ratio),
        "truth_friction": _real("truth_friction", [*truth.friction.coefficients, truth.friction.scale]),
    }


def _real(name: str, value: ArrayLike) -> NDArray[Any]:
    array = np.asarray(value)
    keep = name in FLOAT32_ALLOWED and array.dtype == np.float32
    return np.array(array, dtype="<f4" if keep else "<f8", order="C")


def _npy(array: NDArray[Any]) -> bytes:
    buffer = io.BytesIO()
    np.lib.format.write_array(buffer, array, version=(1, 0), allow_pickle=False)
    return buffer.getvalue()


def _npy_members(log: GraspLogLike) -> Iterator[tuple[str, bytes]]:
    """One at a time, so that a log is never there twice."""
    return ((f"{name}.npy", _npy(array)) for name, array in members(log).items())


def _zip(target: IO[bytes], members: Iterable[tuple[str, bytes]]) -> None:
    with zipfile.ZipFile(target, "w", zipfile.ZIP_STORED) as archive:
        for name, content in members:
            entry = zipfile.ZipInfo(name, date_time=EPOCH)
            entry.create_system, entry.external_attr = 3, 0o644 << 16  # as on Unix, wherever it is written
            archive.writestr(entry, content)
