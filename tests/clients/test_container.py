import io
import zipfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from stiction_client import InvalidArgument, container


def arrays(content: bytes) -> dict[str, np.ndarray]:
    with np.load(io.BytesIO(content), allow_pickle=False) as archive:
        return dict(archive)


def test_numpy_reads_what_was_written(log: Any) -> None:
    members = arrays(container.encode(log))
    assert members["format"].item() == "stiction-grasp-log"
    assert members["version"].item() == 1
    np.testing.assert_array_equal(members["displacement"], log.displacement)
    np.testing.assert_array_equal(members["truth_friction"], [0.4, 0.1, -0.2, 0.03])
    assert members["metadata"].item() == '{"a": "1", "b": "2"}'


def test_equal_logs_are_equal_bytes(log: Any) -> None:
    other = replace(
        log, metadata=dict(reversed(log.metadata.items())), displacement=np.asfortranarray(log.displacement)
    )
    assert container.encode(other) == container.encode(log)
    assert container.encode(replace(log, sensor="other")) != container.encode(log)


def test_nothing_in_the_bytes_depends_on_clock_or_compressor(log: Any) -> None:
    with zipfile.ZipFile(io.BytesIO(container.encode(log))) as archive:
        for entry in archive.infolist():
            assert entry.date_time == (1980, 1, 1, 0, 0, 0)
            assert entry.compress_type == zipfile.ZIP_STORED
            assert entry.create_system == 3


def test_single_precision_is_kept_where_the_container_allows_it(log: Any) -> None:
    single = replace(log, displacement=log.displacement.astype(np.float32), time=log.time.astype(np.float32))
    members = arrays(container.encode(single))
    assert members["displacement"].dtype == np.float32
    assert members["time"].dtype == np.float64
    assert len(container.encode(single)) < len(container.encode(log))


def test_absent_parts_are_absent_members(log: Any) -> None:
    members = arrays(container.encode(replace(log, force=None, truth=None, normal=None, object_pose=None)))
    assert sorted(members) == [
        "displacement",
        "element_area",
        "format",
        "metadata",
        "position",
        "sensor",
        "time",
        "version",
    ]


def test_a_written_file_holds_the_encoded_bytes(log: Any, tmp_path: Path) -> None:
    path = container.write(log, str(tmp_path / "log.npz"))
    assert path.read_bytes() == container.encode(log)


def test_a_folder_is_packed_with_its_arrays_alone(tmp_path: Path) -> None:
    np.save(tmp_path / "index.npy", np.arange(3))
    (tmp_path / "overview.csv").write_text("a,b")
    packed = container.pack_folder(tmp_path)
    with zipfile.ZipFile(io.BytesIO(packed)) as archive:
        assert archive.namelist() == [f"{tmp_path.name}/index.npy"]
    assert packed == container.pack_folder(tmp_path)


def test_a_folder_without_arrays_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InvalidArgument, match="folder is"):
        container.pack_folder(tmp_path)


def test_members_stand_in_one_order_and_may_be_read_by_all(log: Any) -> None:
    with zipfile.ZipFile(io.BytesIO(container.encode(log))) as archive:
        names = [entry.filename for entry in archive.infolist()]
        assert {entry.external_attr for entry in archive.infolist()} == {0o644 << 16}
    told = ["format", "version", "sensor", "metadata", "time", "position", "displacement", "element_area"]
    assert names[:8] == [f"{name}.npy" for name in told]
    truth = ["truth_contact", "truth_slip_kinematic", "truth_slip_contact_factor", "truth_stick_ratio"]
    assert names[-5:] == [f"{name}.npy" for name in (*truth, "truth_friction")]


@pytest.mark.parametrize(
    ("name", "given", "dtype"),
    [
        ("contact", [[1, 0]], "bool"),
        ("observed", [[0, 1]], "bool"),
        ("gripper_force", np.array([5, 6], dtype=np.float32), "<f8"),
        ("gripper_force_deviation", 0.5, "<f8"),
    ],
)
def test_what_older_logs_lack_is_written_where_it_is_there(log: Any, name: str, given: Any, dtype: str) -> None:
    class Newer:
        def __getattr__(self, asked: str) -> Any:
            return given if asked == name else getattr(log, asked)

    member = container.members(Newer())[name]
    assert member.dtype == np.dtype(dtype)
    np.testing.assert_array_equal(member, given)
    assert name not in container.members(log) or getattr(log, name) is not None


@pytest.mark.parametrize("name", ["time", "position", "element_area", "object_pose", "truth_friction"])
def test_single_precision_is_doubled_where_the_container_has_none(log: Any, name: str) -> None:
    assert container.members(log)[name].dtype == np.dtype("<f8")


def test_arrays_of_another_order_of_bytes_or_axes_are_turned(log: Any) -> None:
    other = replace(log, force=np.asfortranarray(np.asarray(log.force).astype(">f4")))
    member = container.members(other)["force"]
    assert (member.dtype, member.flags.c_contiguous) == (np.dtype("<f8"), True)
    np.testing.assert_array_equal(member, other.force)
