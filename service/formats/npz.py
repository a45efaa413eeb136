"""Stiction's own NPZ container, version 1 (docs/formats.md); its writer is ``stiction_client.container``."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from service.formats.archive import open_archive, read_member
from slipcore.errors import InvalidInput
from slipcore.frames import FrictionLaw, GraspLog, GroundTruth
from stiction_client.container import FORMAT, VERSION

Members = Mapping[str, NDArray[Any]]

_TEXT, _INTEGER, _FLAG, _FLOAT64, _FLOAT = ("text",), ("int64",), ("bool",), ("float64",), ("float64", "float32")
_REQUIRED = {
    "format": _TEXT,
    "version": _INTEGER,
    "time": _FLOAT64,
    "position": _FLOAT64,
    "displacement": _FLOAT,
    "element_area": _FLOAT64,
}
_OPTIONAL = {
    "force": _FLOAT,
    "normal": _FLOAT,
    "object_pose": _FLOAT64,
    "contact": _FLAG,
    "observed": _FLAG,
    "sensor": _TEXT,
    "metadata": _TEXT,
}
_TRUTH = {
    "truth_contact": _FLAG,
    "truth_slip_kinematic": _FLAG,
    "truth_slip_contact_factor": _FLAG,
    "truth_stick_ratio": _FLOAT64,
    "truth_friction": _FLOAT64,
}
_DTYPES = _REQUIRED | _OPTIONAL | _TRUTH


def read(path: Path) -> GraspLog:
    """Read a grasp log from an NPZ container. Raises ``InvalidInput`` naming the member that is wrong."""
    members = _members(path)
    _expect("format", _scalar(members, "format"), FORMAT)
    _expect("version", _scalar(members, "version"), VERSION)
    return GraspLog(
        time=members["time"],
        position=members["position"],
        displacement=members["displacement"],
        element_area=_scalar(members, "element_area"),
        force=members.get("force"),
        normal=members.get("normal"),
        object_pose=members.get("object_pose"),
        sensor=_scalar(members, "sensor") if "sensor" in members else "unknown",
        metadata=_metadata(_scalar(members, "metadata")) if "metadata" in members else {},
        truth=_truth(members),
        contact=members.get("contact"),
        observed=members.get("observed"),
    )


def _members(path: Path) -> dict[str, NDArray[Any]]:
    with open_archive(path) as archive:
        names = [member.removesuffix(".npy") for member in archive.namelist()]
        unknown = sorted(set(archive.namelist()) - {f"{name}.npy" for name in _DTYPES})
        missing = [name for name in _REQUIRED if name not in names]
        if unknown or missing:
            value = f"without {', '.join(missing)}" if missing else f"with the unknown {', '.join(unknown)[:200]}"
            raise InvalidInput("members", value, f"{', '.join(_REQUIRED)}; optional {', '.join(_OPTIONAL | _TRUTH)}")
        return {name: _checked(name, read_member(archive, f"{name}.npy", name)) for name in names}


def _checked(name: str, array: NDArray[Any]) -> NDArray[Any]:
    dtype = "text" if array.dtype.kind == "U" else array.dtype.newbyteorder("=").name
    if dtype not in _DTYPES[name]:
        raise InvalidInput(name, f"of dtype {dtype}", " or ".join(_DTYPES[name]))
    return array


def _scalar(members: Members, name: str) -> Any:
    array = members[name]
    if array.shape != ():
        raise InvalidInput(name, f"of shape {list(array.shape)}", "a single value (shape [])")
    try:
        value = array.item()
        str(value).encode()  # text must be storable: no lone surrogates
    except ValueError as error:
        raise InvalidInput(name, "not valid Unicode", "Unicode text") from error
    return value


def _expect(name: str, value: object, expected: object) -> None:
    if value != expected:
        raise InvalidInput(name, repr(value)[:100], repr(expected))


def _metadata(text: str) -> dict[str, str]:
    allowed = "a JSON object of strings"
    try:
        entries = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise InvalidInput("metadata", f"not JSON ({error})", allowed) from error
    if not isinstance(entries, dict) or not all(isinstance(value, str) for value in entries.values()):
        raise InvalidInput("metadata", text[:100], allowed)
    return entries


def _truth(members: Members) -> GroundTruth | None:
    missing = [name for name in _TRUTH if name not in members]
    if len(missing) == len(_TRUTH):
        return None
    if missing:
        raise InvalidInput("truth", f"without {', '.join(missing)}", "all of the truth's members, or none")
    friction = members["truth_friction"]
    if friction.shape != (4,):
        raise InvalidInput("truth_friction", f"of shape {list(friction.shape)}", "shape [4]: β₀, β₁, β₂, σ")
    intercept, velocity, force, scale = (float(value) for value in friction)
    masks = {name: members[f"truth_{name}"] for name in ("contact", "slip_kinematic", "slip_contact_factor")}
    stick_ratio = np.array(members["truth_stick_ratio"], dtype=np.float64)
    law = FrictionLaw((intercept, velocity, force), scale)
    return GroundTruth(**masks, stick_ratio=stick_ratio, friction=law)
