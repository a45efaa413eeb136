"""A LeRobot data set: its layout as documented, read back by pandas, and a log from each of its episodes."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest

from service import exports, formats
from service.exports import DetectedLog
from slipcore import InvalidInput

ARROW = {"double": "float64", "float": "float32"}
"""Arrow's names of types that NumPy calls otherwise."""

DATA = "data/chunk-000/file-000.parquet"


@pytest.fixture(scope="module")
def second(recording: DetectedLog) -> DetectedLog:
    """Another grasp of the same sensor: the first one's later half, with a task of its own."""
    log, history = recording.log, recording.history
    later = slice(len(log) // 2, None)
    parts = {name: getattr(history, name)[later] for name in ("contact", "slip", "stick_ratio")}
    told = replace(log.take(later), metadata={"task": "lift the cup"})
    return DetectedLog(told, replace(history, **parts), "later")


@pytest.fixture(scope="module")
def folder(recording: DetectedLog, second: DetectedLog, tmp_path_factory: pytest.TempPathFactory) -> Path:
    output = tmp_path_factory.mktemp("lerobot") / "grasps"
    exports.write([recording, second], output, exports.target_of(output))
    return output


@pytest.fixture(scope="module")
def info(folder: Path) -> Any:
    return json.loads((folder / "meta/info.json").read_text())


def test_the_description_is_of_version_3(folder: Path, info: Any, recording: DetectedLog, second: DetectedLog) -> None:
    frames = len(recording.log) + len(second.log)
    assert info["codebase_version"] == "v3.0"
    assert (info["total_episodes"], info["total_frames"], info["total_tasks"]) == (2, frames, 2)
    assert info["fps"] == round(1.0 / np.median(np.diff(recording.log.time)))
    assert info["splits"] == {"train": "0:2"}
    assert (folder / info["data_path"].format(chunk_index=0, file_index=0)).is_file()


def test_every_column_is_a_feature_of_its_shape_and_type(folder: Path, info: Any) -> None:
    table = pq.read_table(folder / DATA)
    assert table.column_names == list(info["features"])
    for name, feature in info["features"].items():
        first = np.array(table[name][0].as_py(), feature["dtype"])
        assert list(first.shape or (1,)) == feature["shape"], name
        kind = str(_innermost(table.schema.field(name).type))
        assert ARROW.get(kind, kind) == feature["dtype"], name


def _innermost(kind: Any) -> Any:
    while hasattr(kind, "value_type"):
        kind = kind.value_type
    return kind


def test_frames_count_through_episodes_and_time_runs_evenly(
    folder: Path, info: Any, recording: DetectedLog, second: DetectedLog
) -> None:
    table = pd.read_parquet(folder / DATA)
    lengths = [len(recording.log), len(second.log)]
    assert table["index"].tolist() == list(range(sum(lengths)))
    assert table["frame_index"].tolist() == [*range(lengths[0]), *range(lengths[1])]
    assert table["episode_index"].tolist() == [0] * lengths[0] + [1] * lengths[1]
    np.testing.assert_allclose(table["timestamp"], table["frame_index"] / info["fps"], rtol=1e-6)


def test_episodes_and_tasks_say_where_each_is(folder: Path, recording: DetectedLog, second: DetectedLog) -> None:
    episodes = pd.read_parquet(folder / "meta/episodes/chunk-000/file-000.parquet")
    assert episodes["length"].tolist() == [len(recording.log), len(second.log)]
    assert episodes["dataset_to_index"].tolist() == np.cumsum(episodes["length"]).tolist()
    assert episodes["dataset_from_index"].tolist() == [0, len(recording.log)]
    assert episodes["data/file_index"].tolist() == [0, 0]
    tasks = pd.read_parquet(folder / "meta/tasks.parquet")
    assert tasks.index.tolist() == ["hold the object", "lift the cup"]
    assert [list(each) for each in episodes["tasks"]] == [["hold the object"], ["lift the cup"]]
    frames = pd.read_parquet(folder / DATA)
    assert frames.groupby("episode_index")["task_index"].unique().map(list).tolist() == [[0], [1]]


def test_slip_is_among_the_features(folder: Path, recording: DetectedLog) -> None:
    frames = pd.read_parquet(folder / DATA).query("episode_index == 0")
    history = recording.history
    states = np.array([[list(row) for row in frame] for frame in frames["observation.slip_state"]])
    np.testing.assert_array_equal(states == 2, history.slip & history.contact)
    np.testing.assert_array_equal(states > 0, history.contact)
    expected = np.where(history.contact.any(axis=(1, 2)), history.stick_ratio, 1.0)
    np.testing.assert_allclose(frames["observation.stick_ratio"], expected, rtol=1e-6)


def test_statistics_are_those_of_the_frames(folder: Path, recording: DetectedLog, second: DetectedLog) -> None:
    stats = json.loads((folder / "meta/stats.json").read_text())
    assert recording.log.force is not None
    assert second.log.force is not None
    force = np.concatenate([recording.log.force, second.log.force])
    np.testing.assert_allclose(stats["observation.force"]["mean"], force.mean(axis=0), atol=1e-7)
    np.testing.assert_allclose(stats["observation.force"]["max"], force.max(axis=0), atol=1e-7)
    assert stats["observation.force"]["count"] == [len(force)]


def test_statistics_of_each_episode_stand_beside_it(folder: Path, second: DetectedLog) -> None:
    episodes = pd.read_parquet(folder / "meta/episodes/chunk-000/file-000.parquet")
    assert second.log.force is not None
    told = np.array([[list(row) for row in rows] for rows in episodes["stats/observation.force/q90"][1]])
    np.testing.assert_allclose(told, np.quantile(second.log.force, 0.9, axis=0), atol=1e-7)
    assert episodes["stats/observation.stick_ratio/count"][1].tolist() == [len(second.log)]


def test_a_grippers_force_is_a_feature_and_comes_back(recording: DetectedLog, tmp_path: Path) -> None:
    log = replace(recording.log, gripper_force=np.arange(float(len(recording.log))), gripper_force_deviation=0.5)
    exports.write([replace(recording, log=log)], tmp_path / "grasp", exports.target_of(tmp_path / "grasp"))
    back = formats.read(tmp_path / "grasp" / DATA)
    np.testing.assert_array_equal(back.gripper_force, log.gripper_force)
    assert back.gripper_force_deviation == 0.5
    pair = [replace(recording, log=replace(log, gripper_force_deviation=known)) for known in (0.5, 0.6)]
    with pytest.raises(InvalidInput, match=r"of a gripper's force known to 0.6 N; allowed: as the first log's, 0.5 N"):
        exports.write(pair, tmp_path / "pair", exports.target_of(tmp_path / "pair"))


def test_lerobot_itself_loads_it(folder: Path, recording: DetectedLog, second: DetectedLog) -> None:
    """With what trains on it: where LeRobot is installed, which brings PyTorch."""
    reason = "lerobot is not installed: pip install lerobot"
    loaded = pytest.importorskip("lerobot.datasets.lerobot_dataset", reason=reason).LeRobotDataset("me/it", root=folder)
    assert (len(loaded), loaded.num_episodes) == (len(recording.log) + len(second.log), 2)
    last = loaded[len(loaded) - 1]
    assert second.log.force is not None
    np.testing.assert_array_equal(last["observation.force"], second.log.force[-1].astype(np.float32))
    assert (last["task"], int(last["frame_index"])) == ("lift the cup", len(second.log) - 1)


@pytest.mark.parametrize("episode", [0, 1])
def test_an_episode_is_read_back_as_a_log(
    folder: Path, recording: DetectedLog, second: DetectedLog, episode: int
) -> None:
    log = (recording, second)[episode].log
    back = formats.read(folder / DATA, mapping=json.dumps({"episode": episode}))
    np.testing.assert_array_equal(back.time, log.time)
    np.testing.assert_array_equal(back.position, log.position)
    np.testing.assert_array_equal(back.displacement, log.displacement.astype(np.float32))
    assert log.force is not None
    np.testing.assert_array_equal(back.force, log.force.astype(np.float32))
    assert (back.element_area, back.sensor, back.contact) == (log.element_area, log.sensor, None)


def test_a_log_of_forces_alone_stays_one(recording: DetectedLog, tmp_path: Path) -> None:
    alone = DetectedLog(replace(recording.log, displacement=None, truth=None), recording.history, "alone")
    exports.write([alone], tmp_path / "alone", "lerobot")
    assert "observation.displacement" not in pq.read_table(tmp_path / "alone" / DATA).column_names
    read = formats.read(tmp_path / "alone", mapping='{"episode": 0}')
    assert not read.has_displacement
    assert read.force is not None
    np.testing.assert_allclose(read.force, recording.log.force, rtol=1e-6, atol=0.0)  # of single precision


def test_logs_of_different_sensors_or_members_are_refused(recording: DetectedLog, tmp_path: Path) -> None:
    log = recording.log
    bare = DetectedLog(replace(log, force=None, truth=None), recording.history, "bare.npz")
    moved = DetectedLog(replace(log, position=log.position * 1.01), recording.history, "moved.npz")
    with pytest.raises(InvalidInput, match=r"bare\.npz is with other members"):
        exports.write([recording, bare], tmp_path / "a", "lerobot")
    with pytest.raises(InvalidInput, match=r"moved\.npz is of a sensor with other markers"):
        exports.write([recording, moved], tmp_path / "b", "lerobot")
    assert not list(tmp_path.iterdir())


def test_a_folder_that_holds_something_is_left_alone(recording: DetectedLog, tmp_path: Path) -> None:
    (tmp_path / "kept").write_text("mine")
    with pytest.raises(InvalidInput, match="allowed: a folder that is empty or not there yet"):
        exports.write([recording], tmp_path, "lerobot")
    assert [path.name for path in tmp_path.iterdir()] == ["kept"]
