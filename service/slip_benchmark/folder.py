"""The files of a benchmark (docs/slip-benchmark.md): manifest, inputs, truth and predictions, each written whole."""

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from service.formats.archive import open_archive, read_member
from service.slip_benchmark.scenes import FORMAT, VERSION
from service.whole_files import write_whole
from slipcore.errors import InvalidInput
from slipcore.frames import BoolArray, FloatArray

MANIFEST, CARD, RESULTS, RUN = "manifest.json", "README.md", "results", "run.json"
Arrays = Mapping[str, NDArray[Any]]


@dataclass(frozen=True, slots=True)
class SceneEntry:
    """A scene in the manifest: its ``kind`` of sensor, ``fault``, size, and the SHA-256 of its files."""

    name: str
    kind: str
    fault: str
    marker_noise: float
    force_noise: float
    frames: int
    elements: tuple[int, int]
    input_sha256: str
    truth_sha256: str


@dataclass(frozen=True, slots=True)
class Manifest:
    """What a folder holds; ``seal``: the SHA-256 of its phrase; ``kinds``: names of its sensors."""

    seal: str
    kinds: tuple[str, ...]
    licence: str
    made_by: str
    scenes: tuple[SceneEntry, ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class Truth:
    """What is known of a scene (members of its file): see docs/slip-benchmark.md for shapes and units."""

    time: FloatArray
    contact: BoolArray
    slip: BoolArray
    slip_kinematic: BoolArray
    macro_slip: BoolArray
    stick_ratio: FloatArray
    stick_area_ratio: FloatArray
    displacement: NDArray[np.floating[Any]]
    force: NDArray[np.floating[Any]]
    object_pose: FloatArray
    friction_law: FloatArray
    friction: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Prediction:
    """What a method says of a scene: ``slip`` and its ``probability`` [t, n, m], ``macro_slip`` [t], ``friction`` of
    the contact, and ``force`` [t, n, m, 3] N; all but slip may be left out.
    """

    slip: BoolArray
    probability: FloatArray | None = None
    macro_slip: BoolArray | None = None
    friction: float | None = None
    force: FloatArray | None = None


def input_path(folder: Path, scene: str) -> Path:
    """Of a scene's log, without truth."""
    return folder / "inputs" / f"{scene}.npz"


def truth_path(folder: Path, scene: str) -> Path:
    """Of a scene's truth."""
    return folder / "truth" / f"{scene}.npz"


def prediction_path(folder: Path, method: str, scene: str) -> Path:
    """Of what a method says of a scene."""
    return folder / RESULTS / method / f"{scene}.npz"


def write_arrays(path: Path, arrays: Arrays) -> None:
    """Write arrays as NPZ, the same bytes for the same arrays; whole or not at all."""
    write_whole(path, lambda beside: np.savez_compressed(beside, allow_pickle=False, **arrays))


def sha256(path: Path) -> str:
    """Of a file."""
    return hashlib.sha256(path.read_bytes()).hexdigest()


def check_unchanged(folder: Path, scene: SceneEntry) -> None:
    """Raises ``InvalidInput`` where a scene's files are others than those that were made."""
    known = {input_path(folder, scene.name): scene.input_sha256, truth_path(folder, scene.name): scene.truth_sha256}
    for path, made in known.items():
        if sha256(path) != made:
            raise InvalidInput("scene", f"changed: {path} is not the file of the manifest", "files as they were made")


def is_whole(path: Path) -> bool:
    """Whether a file is there and every member of it is what was written."""
    if not path.is_file():
        return False
    try:
        with open_archive(path) as archive:
            return archive.testzip() is None
    except (InvalidInput, OSError, RuntimeError, ValueError):
        return False


def read_truth(path: Path) -> Truth:
    """A scene's truth; raises ``InvalidInput``."""
    names = [entry.name for entry in fields(Truth)]
    with open_archive(path) as archive:
        for name in names:
            if f"{name}.npy" not in archive.namelist():
                raise InvalidInput(str(path), f"without {name}", "a truth file of this version")
        return Truth(**{name: read_member(archive, f"{name}.npy", name) for name in names})


def read_prediction(path: Path, shape: tuple[int, int, int]) -> Prediction:
    """What a method says of a scene of ``shape`` [t, n, m]; raises ``InvalidInput`` naming the member that is wrong."""
    wanted = {"slip": shape, "probability": shape, "macro_slip": shape[:1], "friction": (), "force": (*shape, 3)}
    with open_archive(path) as archive:
        names = [member.removesuffix(".npy") for member in archive.namelist()]
        unknown = sorted(set(names) - set(wanted))
        if unknown or "slip" not in names:
            value = f"with the unknown {', '.join(unknown)[:100]}" if unknown else "without slip"
            raise InvalidInput("members", value, f"slip; optional {', '.join(list(wanted)[1:])}")
        arrays = {name: _checked(name, read_member(archive, f"{name}.npy", name), wanted[name]) for name in names}
    friction = arrays.pop("friction", None)
    return Prediction(**arrays, friction=None if friction is None else float(friction))


def _checked(name: str, array: NDArray[Any], shape: tuple[int, ...]) -> NDArray[Any]:
    flags = name in ("slip", "macro_slip")
    if array.shape != shape or array.dtype.kind not in ("b" if flags else "fiu"):
        what = "bool" if flags else "real numbers"
        raise InvalidInput(name, f"{array.dtype} of shape {list(array.shape)}", f"{what} of shape {list(shape)}")
    if flags:
        return array
    values = array.astype(np.float64)
    if not np.isfinite(values).all():
        raise InvalidInput(name, "not finite somewhere", "finite numbers; leave out what is not known")
    if name == "probability" and not ((values >= 0.0) & (values <= 1.0)).all():
        raise InvalidInput(name, f"{values.min():.3g} to {values.max():.3g}", "0 to 1")
    return values


def write_manifest(folder: Path, manifest: Manifest) -> None:
    """Write it, whole or not at all."""
    write_json(folder / MANIFEST, {"format": FORMAT, "version": VERSION, **asdict(manifest)})


def write_json(path: Path, record: Mapping[str, Any]) -> None:
    """Write a JSON object, whole or not at all."""
    write_whole(path, lambda beside: beside.write_text(json.dumps(record, indent=1, allow_nan=False), encoding="utf-8"))


def read_manifest(folder: Path) -> Manifest:
    """What a folder holds; raises ``InvalidInput`` where that is no benchmark of this version."""
    path = folder / MANIFEST
    if not path.is_file():
        raise InvalidInput("benchmark", f"{folder}, without {MANIFEST}", "a folder that `stiction benchmark make` made")
    try:
        record = json.loads(path.read_text(encoding="utf-8"))
        if (record.pop("format"), record.pop("version")) != (FORMAT, VERSION):
            raise ValueError(f"needed: {FORMAT} of version {VERSION}")
        scenes = tuple(_entry(entry) for entry in record.pop("scenes"))
        return Manifest(**{**record, "kinds": tuple(record["kinds"])}, scenes=scenes)
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        allowed = f"a manifest of version {VERSION}, as `stiction benchmark make` writes it"
        raise InvalidInput("benchmark", f"{path}, damaged or of something else ({error})", allowed) from error


def _entry(record: Mapping[str, Any]) -> SceneEntry:
    rows, columns = record["elements"]
    if not record["name"].isdecimal():  # it becomes a file's name
        raise ValueError(f"a scene called {record['name']!r}")
    return SceneEntry(**{**record, "elements": (int(rows), int(columns))})


def read_whole_benchmark(folder: Path) -> Manifest:
    """The manifest of a folder that holds all of its scenes; raises ``InvalidInput``."""
    manifest = read_manifest(folder)
    names = [scene.name for scene in manifest.scenes]
    missing = [
        name for name in names if not (input_path(folder, name).is_file() and truth_path(folder, name).is_file())
    ]
    if missing or not names:
        value = (
            f"without {len(missing)} of {len(names)} scenes ({', '.join(missing[:3])})" if names else "not made whole"
        )
        raise InvalidInput(
            f"benchmark in {folder}", value, "all of them: run `stiction benchmark make` with its phrase"
        )
    return manifest


def methods_of(folder: Path) -> Sequence[str]:
    """Names of the methods that have results in the folder."""
    return sorted(path.name for path in (folder / RESULTS).glob("*") if path.is_dir() and not path.name.startswith("."))
