"""LeRobot data sets as folders: each episode a log, what others named otherwise, and what is refused by name."""

import json
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

import slipcore
from service import exports, formats
from service.formats import parquet
from slipcore import GraspLog, InvalidInput

DATA = "data/chunk-000/file-000.parquet"
EPISODES = "meta/episodes/chunk-000/file-000.parquet"


@pytest.fixture(scope="module")
def logs(ramp: GraspLog) -> list[GraspLog]:
    """Three grasps of one sensor, each with a task of its own."""
    parts = (slice(None), slice(40, None), slice(30, 70))
    return [replace(ramp.take(part), metadata={"task": f"lift {k}"}) for k, part in enumerate(parts)]


@pytest.fixture(scope="module")
def exported(logs: list[GraspLog], tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("lerobot") / "grasps"
    recordings = [exports.DetectedLog(log, slipcore.detect_slip(log), str(k)) for k, log in enumerate(logs)]
    exports.write(recordings, folder, "lerobot")
    return folder


@pytest.fixture
def folder(exported: Path, tmp_path: Path) -> Path:
    """A copy of the data set, to be damaged."""
    return shutil.copytree(exported, tmp_path / "grasps")


def change(folder: Path, **entries: Any) -> None:
    """Entries of the description, replaced."""
    path = folder / "meta/info.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | entries))


def test_each_episode_of_our_own_export_comes_back_as_its_log(exported: Path, logs: list[GraspLog]) -> None:
    assert formats.episodes_of(exported) == [0, 1, 2]
    for number, log in enumerate(logs):
        back = formats.read(exported, mapping=json.dumps({"episode": number}))
        assert log.force is not None
        np.testing.assert_array_equal(back.time, log.time)
        np.testing.assert_array_equal(back.position, log.position)
        np.testing.assert_array_equal(back.displacement, log.displacement.astype(np.float32))
        np.testing.assert_array_equal(back.force, log.force.astype(np.float32))
        assert (back.element_area, back.metadata["task"]) == (log.element_area, f"lift {number}")


def test_features_of_other_names_shapes_and_units_are_read_by_a_mapping(folder: Path, logs: list[GraspLog]) -> None:
    """As a data set of a robot has them: flat, in mm, pressure positive, beside other features."""
    table = pq.read_table(folder / DATA)
    displacement, force = (np.concatenate([getattr(log, name) for log in logs]) for name in ("displacement", "force"))
    arm = np.zeros((len(table), 7), np.float32)
    columns = {
        "observation.state": pa.FixedSizeListArray.from_arrays(arm.ravel(), 7),
        "observation.tactile.left": pa.FixedSizeListArray.from_arrays((1e3 * displacement).ravel(), 14 * 14 * 3),
        "observation.tactile.left_force": pa.FixedSizeListArray.from_arrays((-force).ravel(), 14 * 14 * 3),
        **{name: table[name] for name in ("timestamp", "frame_index", "episode_index", "index", "task_index")},
    }
    pq.write_table(pa.table(columns), folder / DATA)
    change(folder, features={name: {"dtype": "float32", "shape": [588], "names": None} for name in columns})
    mapping = {
        "grid": [14, 14],
        "pitch": 0.9e-3,
        "displacement": {"field": "observation.tactile.left", "unit": "mm"},
        "force": {"field": "observation.tactile.left_force", "unit": ["-N", "-N", "-N"]},
    }
    with pytest.raises(InvalidInput, match=r"displacement is not among the features .* observation\.tactile\.left \[5"):
        formats.episodes_of(folder)
    assert formats.episodes_of(folder, json.dumps(mapping)) == [0, 1, 2]
    back = formats.read(folder, mapping=json.dumps({**mapping, "episode": 2}))
    np.testing.assert_allclose(back.displacement, logs[2].displacement, rtol=1e-6)
    np.testing.assert_array_equal(back.force, logs[2].force)
    np.testing.assert_allclose(np.diff(back.time), 1 / 30, rtol=1e-5)
    assert back.position[1, 0, 0] - back.position[0, 0, 0] == pytest.approx(0.9e-3)


def test_episodes_may_be_in_several_files(folder: Path, logs: list[GraspLog]) -> None:
    table, episodes = pq.read_table(folder / DATA), pq.read_table(folder / EPISODES)
    for number, (first, last) in enumerate(zip((0, 82), (82, None), strict=True)):
        part = table.slice(first, None if last is None else last - first)
        pq.write_table(part, folder / f"data/chunk-000/file-{number:03d}.parquet")
    place = episodes.column_names.index("data/file_index")
    pq.write_table(episodes.set_column(place, "data/file_index", pa.array([0, 1, 1])), folder / EPISODES)
    back = formats.read(folder, mapping='{"episode": 2}')
    np.testing.assert_array_equal(back.time, logs[2].time)


def test_episodes_without_end_are_refused_by_name(folder: Path) -> None:
    episodes = pq.read_table(folder / EPISODES)
    numbers = pa.array([0.0, 1.0, np.inf])
    place = episodes.column_names.index("episode_index")
    pq.write_table(episodes.set_column(place, "episode_index", numbers), folder / EPISODES)
    with pytest.raises(InvalidInput, match="OverflowError"):
        formats.episodes_of(folder)


def test_rows_of_other_episodes_are_left_unread(
    exported: Path, logs: list[GraspLog], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A data set may be far larger than a log."""
    rows = 14 * 14 * 3 * 4 * len(logs[2])  # bytes of a member of the last episode
    monkeypatch.setattr(parquet, "MAX_CONTENT_BYTES", 5 * rows)
    assert len(formats.read(exported, mapping='{"episode": 2}')) == len(logs[2])
    with pytest.raises(InvalidInput, match="file is more than"):
        formats.read(exported, mapping='{"episode": 0}')


@pytest.mark.parametrize(("mapping", "value"), [(None, "missing"), ('{"episode": 7}', "7")])
def test_an_episode_has_to_be_one_of_the_data_set(exported: Path, mapping: str | None, value: str) -> None:
    with pytest.raises(InvalidInput, match=f"episode is {value}; allowed: one of 0, 1, 2"):
        formats.read(exported, mapping=mapping)


def test_an_older_version_is_refused_with_what_brings_it_up_to_date(folder: Path) -> None:
    change(folder, codebase_version="v2.1")
    with pytest.raises(InvalidInput, match=r"codebase_version is v2\.1; allowed: v3\.0; python -m lerobot\."):
        formats.episodes_of(folder)


@pytest.mark.parametrize("path", ["../../elsewhere.parquet", "/etc/hostname"])
def test_no_file_outside_of_the_data_set_is_read(folder: Path, path: str) -> None:
    (folder.parent.parent / "elsewhere.parquet").write_bytes((folder / DATA).read_bytes())
    change(folder, data_path=path)
    with pytest.raises(InvalidInput, match=r"^data_path is .*; allowed: a path inside of the data set"):
        formats.episodes_of(folder)


def test_a_file_that_is_a_link_to_itself_is_none(folder: Path) -> None:
    (folder / DATA).unlink()
    (folder / DATA).symlink_to(folder / DATA)
    with pytest.raises(InvalidInput, match=r"^data_path is .*; allowed: a path inside of the data set"):
        formats.episodes_of(folder)


def test_a_missing_file_is_named(folder: Path) -> None:
    (folder / DATA).unlink()
    with pytest.raises(InvalidInput, match=f"^data set is without {DATA}"):
        formats.episodes_of(folder)


@pytest.mark.parametrize("path", ["{0}", "data/{chunk_index.real.__class__}", "data/{chunk_index:4000000000d}", ""])
def test_a_path_that_asks_for_more_than_two_numbers_is_refused(folder: Path, path: str) -> None:
    """As one of 4 GB."""
    change(folder, data_path=path)
    with pytest.raises(InvalidInput, match=r"^data_path is .*; allowed: a path with \{chunk_index:03d\}"):
        formats.episodes_of(folder)


@pytest.mark.parametrize("name", ["meta/info.json", EPISODES, DATA])
def test_a_damaged_data_set_is_refused_by_the_file_that_is(folder: Path, name: str) -> None:
    (folder / name).write_bytes((folder / name).read_bytes()[:100])
    with pytest.raises(InvalidInput, match="damaged"):
        formats.read(folder, mapping='{"episode": 0}')


def test_a_description_with_an_entry_twice_is_refused(folder: Path) -> None:
    path = folder / "meta/info.json"
    path.write_text(path.read_text().replace("{", '{"data_path": "elsewhere", ', 1))
    with pytest.raises(InvalidInput, match="the key 'data_path' more than once"):
        formats.episodes_of(folder)


@pytest.mark.parametrize("entries", [{"features": None}, {"features": {"a": 1}}])
def test_a_description_of_something_else_is_refused(folder: Path, entries: dict[str, Any]) -> None:
    change(folder, **entries)
    with pytest.raises(InvalidInput, match="damaged"):
        formats.episodes_of(folder)
