import io
import zipfile
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import pytest

from slipcore import FrictionLaw, GraspLog, GroundTruth

RECORDINGS = Path(__file__).parents[3] / ".cache/tac3d/PyTac3D/example_data"


def npy(array: object) -> bytes:
    buffer = io.BytesIO()
    np.save(buffer, np.asarray(array), allow_pickle=True)
    return buffer.getvalue()


@pytest.fixture
def as_npy() -> Callable[[object], bytes]:
    return npy


@pytest.fixture
def zip_of(tmp_path: Path) -> Callable[..., Path]:
    """Write members (arrays or raw bytes) into a zip and return its path."""

    def make(members: Mapping[str, object], compression: int = zipfile.ZIP_STORED) -> Path:
        path = tmp_path / "log.zip"
        with zipfile.ZipFile(path, "w", compression) as archive:
            for name, value in members.items():
                archive.writestr(name, value if isinstance(value, bytes) else npy(value))
        return path

    return make


@pytest.fixture
def log() -> GraspLog:
    """A small log with every optional part and a ground truth."""
    generator = np.random.default_rng(3)
    frames, n, m = 5, 3, 4
    x, y = np.meshgrid(np.arange(n) * 1e-3, np.arange(m) * 1e-3, indexing="ij")
    shape = (frames, n, m)
    normal = np.zeros((*shape, 3))
    normal[..., 2] = 1.0
    truth = GroundTruth(
        contact=np.ones(shape, bool),
        slip_kinematic=generator.random(shape) < 0.5,
        slip_contact_factor=generator.random(shape) < 0.5,
        stick_ratio=np.array([np.nan, 1.0, 0.5, 0.25, 0.0]),
        friction=FrictionLaw((0.4, 0.1, -0.2), 0.03),
    )
    return GraspLog(
        time=np.array([0.0, 0.03, 0.07, 0.1, 0.2]),
        position=np.stack([x, y, np.zeros_like(x)], axis=-1),
        displacement=generator.normal(scale=1e-4, size=(*shape, 3)),
        element_area=1e-6,
        force=generator.normal(scale=0.1, size=(*shape, 3)),
        normal=normal,
        object_pose=generator.normal(scale=1e-3, size=(frames, 3)),
        sensor="Prüfstand 1",
        metadata={"operator": "Łukasz", "tier": "closed form"},
        truth=truth,
    )


@pytest.fixture
def recording_fields() -> dict[str, np.ndarray]:
    """A synthetic Tac3D recording in its own units: mm, N, one .npy a field; only frames 3 and 4 are in contact."""
    generator = np.random.default_rng(5)
    frames, side = 6, 4
    y, x = np.meshgrid(-np.arange(side, dtype=float), -np.arange(side, dtype=float), indexing="ij")
    rest = np.stack([x, y, 10.0 - 0.05 * (x**2 + y**2)], axis=-1).reshape(-1, 3)
    displacement = generator.normal(scale=0.1, size=(frames, side * side, 3))
    gated = [0, 1, 2, 5]
    displacement[gated] = 0.0
    force = generator.normal(scale=0.05, size=displacement.shape)
    force[gated] = 0.0
    noise = np.zeros_like(displacement)
    noise[gated] = generator.normal(scale=0.02, size=noise[gated].shape)
    normal = np.zeros_like(displacement)
    normal[..., 2] = 1.0
    return {
        "3D_Positions": rest + displacement + noise,
        "3D_Displacements": displacement,
        "3D_Forces": force,
        "3D_Normals": normal,
        "index": np.array([7, 8, 9, 12, 13, 20]),
        "sendTimestamp": np.array([68.0, 68.03, 68.06, 68.2, 68.23, 68.5]),
    }


@pytest.fixture
def folder_of(tmp_path: Path) -> Callable[[Mapping[str, np.ndarray]], Path]:
    """Write a recording's fields as its sensor's software does."""

    def make(fields: Mapping[str, np.ndarray]) -> Path:
        folder = tmp_path / "AD2-0065L"
        folder.mkdir()
        for name, array in fields.items():
            np.save(folder / f"{name}.npy", array)
        return folder

    return make


@pytest.fixture(params=["example_1/AD2-0065L", "example_2/HDL1-GWH0021", "example_2/HDL1-GWH0022"])
def recording(request: pytest.FixtureRequest) -> Path:
    folder = RECORDINGS / request.param
    if not folder.is_dir():
        pytest.skip("the Tac3D example recordings are not in .cache (make recordings)")
    return folder
