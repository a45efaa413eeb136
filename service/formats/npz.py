"""Stiction's own NPZ container, version 1 (docs/formats.md); its writer is ``stiction_client.container``."""

from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from service.formats.archive import open_archive, read_member
from service.formats.members import DTYPES, INTEGER, OPTIONAL, REQUIRED, TEXT, TRUTH, grasp_log, scalar
from slipcore.errors import InvalidInput
from slipcore.frames import GraspLog
from stiction_client.container import FORMAT, VERSION

_REQUIRED = {"format": TEXT, "version": INTEGER} | REQUIRED
_DTYPES = _REQUIRED | DTYPES


def read(path: Path) -> GraspLog:
    """Read a grasp log from an NPZ container. Raises ``InvalidInput`` naming the member that is wrong."""
    members = _members(path)
    _expect("format", scalar(members, "format"), FORMAT)
    _expect("version", scalar(members, "version"), VERSION)
    return grasp_log(members)


def _members(path: Path) -> dict[str, NDArray[Any]]:
    with open_archive(path) as archive:
        names = [member.removesuffix(".npy") for member in archive.namelist()]
        unknown = sorted(set(archive.namelist()) - {f"{name}.npy" for name in _DTYPES})
        missing = [name for name in _REQUIRED if name not in names]
        if unknown or missing:
            value = f"without {', '.join(missing)}" if missing else f"with the unknown {', '.join(unknown)[:200]}"
            raise InvalidInput("members", value, f"{', '.join(_REQUIRED)}; optional {', '.join(OPTIONAL | TRUTH)}")
        return {name: _checked(name, read_member(archive, f"{name}.npy", name)) for name in names}


def _checked(name: str, array: NDArray[Any]) -> NDArray[Any]:
    dtype = "text" if array.dtype.kind == "U" else array.dtype.newbyteorder("=").name
    if dtype not in _DTYPES[name]:
        raise InvalidInput(name, f"of dtype {dtype}", " or ".join(_DTYPES[name]))
    return array


def _expect(name: str, value: object, expected: object) -> None:
    if value != expected:
        raise InvalidInput(name, repr(value)[:100], repr(expected))
