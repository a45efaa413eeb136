"""Storage files of a recording: in their order, and as many as may be."""

import json
import zipfile
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from service.formats import rosbag
from service.formats.mapping import parse
from slipcore import GraspLog
from slipcore.errors import InvalidInput


def test_storage_files_are_in_the_order_of_their_numbers(tmp_path: Path) -> None:
    for name in ("log_10.db3", "log_9.db3", "log_0.mcap", "metadata.yaml", "log.db3"):
        (tmp_path / name).write_text(name)
    with rosbag._storage_files(tmp_path) as files:
        assert [file.name for file in files] == ["log.db3", "log_0.mcap", "log_9.db3", "log_10.db3"]


def zipped(path: Path, names: list[str]) -> Path:
    with zipfile.ZipFile(path, "w") as archive:
        for name in names:
            archive.writestr(name, name)
    return path


def test_those_of_a_zip_are_unpacked_in_the_same_order_and_go(tmp_path: Path) -> None:
    names = ["a/log_10.db3", "a/log_2.db3", "a/metadata.yaml", "a/log_1.mcap"]
    with rosbag._storage_files(zipped(tmp_path / "bag.zip", names)) as files:
        assert [file.read_text() for file in files] == ["a/log_1.mcap", "a/log_2.db3", "a/log_10.db3"]
        assert [file.suffix for file in files] == [".mcap", ".db3", ".db3"]
    assert not files[0].exists()


def test_a_zip_has_one_storage_file_to_a_hundred(tmp_path: Path) -> None:
    with rosbag._storage_files(zipped(tmp_path / "a.zip", [f"{k}.db3" for k in range(100)])) as files:
        assert len(files) == 100
    for count in (0, 101):
        path = zipped(tmp_path / f"{count}.zip", ["metadata.yaml", *(f"{k}.db3" for k in range(count))])
        told = f"file is a zip of {count} .db3 or .mcap files; allowed: 1 to 100"
        with pytest.raises(InvalidInput, match=told), rosbag._storage_files(path):
            pass


def test_any_other_file_is_a_storage_file_itself(tmp_path: Path) -> None:
    (tmp_path / "bag").write_bytes(b"PK\x03")
    with rosbag._storage_files(tmp_path / "bag") as files:
        assert files == [tmp_path / "bag"]


def test_nobody_is_told_where_a_damaged_file_lies(tmp_path: Path) -> None:
    told = "file is a truncated or damaged rosbag1 (ValueError: the file is odd); allowed: a complete rosbag1 file"
    with pytest.raises(InvalidInput) as refusal, rosbag._library("rosbag1", tmp_path):
        raise ValueError(f"{tmp_path} is odd")
    assert str(refusal.value) == told
    with pytest.raises(OSError, match="full"), rosbag._library("rosbag1", tmp_path):
        raise OSError(28, "full")


@pytest.mark.parametrize("form", ["bag1", "bag2"])
def test_a_bag_is_read_as_its_ros_writes_it(
    robot_log: GraspLog, write: SimpleNamespace, tmp_path: Path, form: str
) -> None:
    path = getattr(write, form)(robot_log, tmp_path / "grasp.bag")
    read = {"bag1": rosbag.read_bag1, "bag2": rosbag.read_bag2}[form]
    log = read(path, parse(json.dumps(write.mapping)))
    assert np.allclose(log.displacement, robot_log.displacement, rtol=1e-12, atol=0.0)
    with pytest.raises(InvalidInput, match="displacement is not there"):
        read(path)
