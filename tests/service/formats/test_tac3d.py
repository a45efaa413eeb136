import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from service.formats import tac3d
from slipcore import GraspLog, InvalidInput
from stiction_client import container

Fields = dict[str, np.ndarray]
FolderOf = Callable[[Fields], Path]
ZipOf = Callable[..., Path]


def assert_same_log(one: GraspLog, other: GraspLog) -> None:
    assert container.encode(one) == container.encode(other)


def test_a_recording_is_read_in_si_units(recording_fields: Fields, folder_of: FolderOf) -> None:
    log = tac3d.read(folder_of(recording_fields))
    assert (log.sensor, log.grid, len(log)) == ("AD2-0065L", (4, 4), 6)
    np.testing.assert_allclose(log.time, [0.0, 0.03, 0.06, 0.2, 0.23, 0.5], rtol=0, atol=1e-12)  # 68.03 has 1e-14
    np.testing.assert_array_equal(log.displacement.reshape(6, 16, 3), recording_fields["3D_Displacements"] * 1e-3)
    assert log.force is not None
    assert log.normal is not None
    np.testing.assert_array_equal(log.force.reshape(6, 16, 3), recording_fields["3D_Forces"])
    np.testing.assert_array_equal(log.normal.reshape(6, 16, 3), recording_fields["3D_Normals"])


def test_the_rest_shape_comes_from_frames_in_contact_only(recording_fields: Fields, folder_of: FolderOf) -> None:
    log = tac3d.read(folder_of(recording_fields))
    y, x = -np.mgrid[:4, :4] * 1e-3
    rest = np.stack([x, y, 10e-3 - 50.0 * (x**2 + y**2)], axis=-1)
    np.testing.assert_allclose(log.position, rest, rtol=0, atol=1e-15)  # gated frames carry 20 µm of noise
    assert log.metadata["gated_frames"] == "4"


def test_a_recording_without_any_contact_takes_the_median_shape(recording_fields: Fields, folder_of: FolderOf) -> None:
    quiet = recording_fields | {"3D_Displacements": np.zeros_like(recording_fields["3D_Displacements"])}
    noise = np.random.default_rng(1).normal(scale=1e-3, size=(6, 16, 3))
    quiet["3D_Positions"] = recording_fields["3D_Positions"][2] + noise
    log = tac3d.read(folder_of(quiet))
    np.testing.assert_allclose(
        log.position.reshape(16, 3), np.median(quiet["3D_Positions"], axis=0) * 1e-3, rtol=0, atol=1e-15
    )
    assert log.metadata["gated_frames"] == "6"


def test_dropped_frames_are_counted_and_the_largest_gap_is_told(recording_fields: Fields, folder_of: FolderOf) -> None:
    metadata = tac3d.read(folder_of(recording_fields)).metadata
    assert metadata["dropped_frames"] == "8"  # 7 … 20 is 14 frames, of which 6 are there
    assert metadata["largest_gap"] == "0.27 s"
    assert metadata["first_index"] == "7"


def test_the_element_area_is_that_of_the_curved_surface(recording_fields: Fields, folder_of: FolderOf) -> None:
    log = tac3d.read(folder_of(recording_fields))
    slope = 0.05 * (2 * np.arange(3) + 1)  # of the cell between markers k and k+1, both ways
    exact = np.sqrt(1.0 + slope[:, None] ** 2 + slope[None, :] ** 2).mean() * 1e-6
    assert log.element_area == pytest.approx(exact, rel=1e-12)  # a paraboloid's cell has this area exactly


@pytest.mark.parametrize("prefix", ["", "AD2-0065L/", "example_1/AD2-0065L/"])
def test_a_zipped_recording_equals_its_folder(
    recording_fields: Fields, folder_of: FolderOf, zip_of: ZipOf, prefix: str
) -> None:
    members = {f"{prefix}{name}.npy": array for name, array in recording_fields.items()}
    extras = {f"__MACOSX/{prefix}._index.npy": b"finder", f"{prefix}overview.csv": b"a,b"}
    extras |= {"notes/shape.npy": b"of something else", f"notes/{tac3d.REQUIRED[0]}.txt": b"how it was measured"}
    packed = tac3d.read(zip_of(members | extras, zipfile.ZIP_DEFLATED))
    folder = tac3d.read(folder_of(recording_fields))
    np.testing.assert_array_equal(packed.displacement, folder.displacement)
    np.testing.assert_array_equal(packed.position, folder.position)
    assert packed.sensor == ("AD2-0065L" if prefix else "unknown")


def test_two_recordings_in_one_zip_are_refused(recording_fields: Fields, zip_of: ZipOf) -> None:
    members = {f"{sensor}/{name}.npy": array for sensor in "ab" for name, array in recording_fields.items()}
    with pytest.raises(InvalidInput, match=r"a zip of 2 recordings \(a, b\)"):
        tac3d.read(zip_of(members))


def test_forces_and_normals_are_optional(recording_fields: Fields, folder_of: FolderOf) -> None:
    fields = {name: array for name, array in recording_fields.items() if name not in {"3D_Forces", "3D_Normals"}}
    log = tac3d.read(folder_of(fields))
    assert log.force is log.normal is None


@pytest.mark.parametrize("name", ["3D_Positions", "3D_Displacements", "index", "sendTimestamp"])
def test_a_missing_field_is_named(recording_fields: Fields, folder_of: FolderOf, name: str) -> None:
    del recording_fields[name]
    with pytest.raises(InvalidInput, match=f"fields is without {name}"):
        tac3d.read(folder_of(recording_fields))


def with_index(fields: Fields, name: str, place: tuple[int, ...], value: float) -> Fields:
    field = fields[name]
    changed = field.astype(np.float64) if field.dtype.kind == "i" and isinstance(value, float) else field.copy()
    changed[place] = value
    return fields | {name: changed}


@pytest.mark.parametrize(
    ("name", "place", "value", "message"),
    [
        ("index", (3,), 9, "index is 9 at frame 3, after 9; allowed: one strictly increasing number"),
        ("index", (3,), 2, "index is 2 at frame 3, after 9"),
        ("sendTimestamp", (4,), 68.2, "sendTimestamp is 68.2 at frame 4, after 68.2"),
        ("sendTimestamp", (4,), 3.0, "sendTimestamp is 3 at frame 4, after 68.2"),
        ("index", (5,), np.inf, "index is inf at frame 5; allowed: one strictly increasing number a frame, within"),
        ("index", (0,), -1e300, "index is -1e[+]300 at frame 0"),
        ("sendTimestamp", (4,), np.nan, "sendTimestamp is nan at frame 4"),
        ("3D_Displacements", (3, 2, 1), np.nan, r"3D_Displacements is nan at index \[3, 0, 2, 1\] \(1 in all\)"),
        ("3D_Positions", (3, 2, 1), np.inf, "3D_Positions is inf"),
        ("3D_Forces", (3, 2, 1), np.nan, "force is nan"),
        ("3D_Positions", (3, 2, 1), 5.0, "3D_Positions - 3D_Displacements is off one rest shape by up to"),
    ],
)
def test_a_wrong_number_is_named_with_its_place(
    recording_fields: Fields, folder_of: FolderOf, name: str, place: tuple[int, ...], value: float, message: str
) -> None:
    with pytest.raises(InvalidInput, match=message):
        tac3d.read(folder_of(with_index(recording_fields, name, place, value)))


@pytest.mark.parametrize(
    ("name", "array", "message"),
    [
        ("3D_Forces", np.zeros((6, 15, 3)), "a square number of markers"),
        ("3D_Forces", np.zeros((6, 16)), "3D_Forces is float64 of shape"),
        ("3D_Forces", np.zeros((6, 16, 3), int), "3D_Forces is int64"),
        ("3D_Forces", np.zeros((5, 16, 3)), "frames is .*5 in 3D_Forces"),
        ("3D_Forces", np.zeros((6, 0, 3)), "3D_Forces is float64 of shape"),
        ("3D_Forces", np.zeros((6, 9, 3)), "force is of shape"),
        ("index", np.zeros((2, 3)), "index is float64 of shape"),
        ("index", np.array(["a"] * 6), "index is <U1 of shape"),
    ],
)
def test_a_field_of_the_wrong_shape_or_kind_is_named(
    recording_fields: Fields, folder_of: FolderOf, name: str, array: np.ndarray, message: str
) -> None:
    with pytest.raises(InvalidInput, match=message):
        tac3d.read(folder_of(recording_fields | {name: array}))


def test_a_field_cut_off_is_named(recording_fields: Fields, folder_of: FolderOf) -> None:
    folder = folder_of(recording_fields)
    path = folder / "3D_Forces.npy"
    path.write_bytes(path.read_bytes()[:-10])
    with pytest.raises(InvalidInput, match=r"3D_Forces is .* bytes by its header"):
        tac3d.read(folder)


def test_a_folder_over_the_limit_is_refused(
    recording_fields: Fields, folder_of: FolderOf, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tac3d, "MAX_ARRAY_BYTES", 1000)
    with pytest.raises(InvalidInput, match=r"folder is .* bytes; allowed: at most 1000"):
        tac3d.read(folder_of(recording_fields))


def test_a_lattice_of_one_marker_has_no_area(recording_fields: Fields, folder_of: FolderOf) -> None:
    fields = {name: array[:, :1] if array.ndim == 3 else array for name, array in recording_fields.items()}
    with pytest.raises(InvalidInput, match="at least 2 markers a side"):
        tac3d.read(folder_of(fields))


def test_real_recordings_are_read_whole(recording: Path) -> None:
    log = tac3d.read(recording)
    raw = np.load(recording / "3D_Displacements.npy")
    assert log.sensor == recording.name
    assert log.grid == (20, 20)
    np.testing.assert_array_equal(log.displacement.reshape(raw.shape), raw * 1e-3)
    index = np.load(recording / "index.npy")
    assert int(log.metadata["dropped_frames"]) == index[-1] - index[0] + 1 - len(index)


def test_facts_of_the_real_recordings_stand_as_documented(recording: Path) -> None:
    log = tac3d.read(recording)
    assert log.force is not None
    in_contact = log.displacement.any(axis=(1, 2, 3))
    np.testing.assert_array_equal(log.force.any(axis=(1, 2, 3)), in_contact)  # one gate for both
    rows, columns = np.diff(log.position, axis=0).mean((0, 1)), np.diff(log.position, axis=1).mean((0, 1))
    assert rows[1] < -0.9e-3  # rows run along -y,
    assert columns[0] < -0.9e-3  # columns along -x
    assert abs(rows[0]) + abs(columns[1]) < 0.05e-3
    assert (log.force[in_contact].sum(axis=(1, 2))[:, 2] < 0.0).all()  # the object pushes into the sensor, z points out
    assert 0.9e-6 < log.element_area < 1.3e-6
    middle, corner = log.position[9:11, 9:11, 2].mean(), log.position[[0, 0, -1, -1], [0, -1, 0, -1], 2].mean()
    assert middle > corner + 2e-3  # a dome, highest in the middle


def test_a_real_recording_zipped_by_the_client_gives_the_same_log(recording: Path, tmp_path: Path) -> None:
    packed = tmp_path / "recording.zip"
    packed.write_bytes(container.pack_folder(recording))
    assert_same_log(tac3d.read(packed), tac3d.read(recording))
