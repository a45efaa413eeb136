"""A LeRobot data set (v3.0): one episode a log, tactile features by name (docs/exports.md)."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

from service.exports import DetectedLog
from service.formats.parquet import LOG_KEY
from slipcore.errors import InvalidInput
from slipcore.frames import GraspLog
from slipcore.slip_state import element_states
from stiction_client.container import members

VERSION = "v3.0"
DATA_PATH = "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
EPISODES_PATH = "meta/episodes/chunk-000/file-000.parquet"
FILE_SIZES_MB = {"data_files_size_in_mb": 100, "video_files_size_in_mb": 500}
CHUNK_SIZE = 1000

FEATURES = ("displacement", "force", "normal", "object_pose", "gripper_force")
"""Members of a log that are features, where it has them."""

QUANTILES = {"q01": 0.01, "q10": 0.1, "q50": 0.5, "q90": 0.9, "q99": 0.99}
"""Statistics by which LeRobot normalises the inputs of some policies."""

OF_A_SENSOR = ("position", "element_area", "gripper_force_deviation", "sensor")
"""Members that all logs of a data set share."""

Columns = dict[str, NDArray[Any]]


def write(recordings: Sequence[DetectedLog], folder: Path) -> None:
    """Write the data set; raises ``InvalidInput`` for logs of different sensors."""
    _check_alike(recordings)
    rate = _frame_rate(recordings)
    parts = [_episode(recording, number, rate) for number, recording in enumerate(recordings)]
    lengths = [len(recording.log) for recording in recordings]
    columns = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    columns["index"] = np.arange(sum(lengths))
    tasks = sorted({_task(recording) for recording in recordings})
    columns["task_index"] = np.repeat([tasks.index(_task(recording)) for recording in recordings], lengths)
    data = folder / DATA_PATH.format(chunk_index=0, file_index=0)
    _write_table(data, _split(columns, lengths), _once(recordings[0]))
    _write_table(folder / EPISODES_PATH, [_episodes(recordings, columns, lengths)])
    _write_tasks(folder / "meta/tasks.parquet", tasks)
    _write_json(folder / "meta/info.json", _info(columns, lengths, len(tasks), rate))
    _write_json(folder / "meta/stats.json", {name: _statistics(column) for name, column in columns.items()})


def _check_alike(recordings: Sequence[DetectedLog]) -> None:
    first = recordings[0].log
    present = list(_features(first))
    for recording in recordings[1:]:
        log = recording.log
        if list(_features(log)) != present:
            raise InvalidInput(recording.name, "with other members than the first log", f"those: {', '.join(present)}")
        if log.gripper_force_deviation != first.gripper_force_deviation:
            deviation = f"of a gripper's force known to {log.gripper_force_deviation} N"
            raise InvalidInput(recording.name, deviation, f"as the first log's, {first.gripper_force_deviation} N")
        if not np.array_equal(log.position, first.position):
            raise InvalidInput(recording.name, "of a sensor with other markers", "logs of one sensor in a data set")


def _features(log: GraspLog) -> Columns:
    """The features that the log has, by name."""
    features = {name: getattr(log, name) for name in FEATURES if name != "displacement" or log.has_displacement}
    return {name: values for name, values in features.items() if values is not None}


def _frame_rate(recordings: Sequence[DetectedLog]) -> int:
    """Frames a second, by the usual step between frames; LeRobot counts whole ones."""
    steps = np.concatenate([np.diff(recording.log.time) for recording in recordings])
    return max(1, round(1.0 / float(np.median(steps))))


def _task(recording: DetectedLog) -> str:
    return recording.log.metadata.get("task", "hold the object")


def _episode(recording: DetectedLog, number: int, rate: int) -> Columns:
    """The frames of a log. Time runs evenly in ``timestamp``, as LeRobot wants it; the log's own is beside it."""
    log, history = recording.log, recording.history
    frames = np.arange(len(log))
    return {
        **{f"observation.{name}": values.astype(np.float32) for name, values in _features(log).items()},
        "observation.slip_state": element_states(history.contact, history.slip),
        "observation.stick_ratio": np.nan_to_num(history.stick_ratio, nan=1.0).astype(np.float32),
        "observation.time": log.time,
        "timestamp": (frames / rate).astype(np.float32),
        "frame_index": frames,
        "episode_index": np.full(len(log), number),
    }


def _once(recording: DetectedLog) -> dict[bytes, str]:
    """What there is one of, as our own Parquet tables hold it."""
    arrays = members(recording.log)
    return {LOG_KEY: json.dumps({name: arrays[name].tolist() for name in OF_A_SENSOR if name in arrays})}


def _split(columns: Columns, lengths: Sequence[int]) -> list[Columns]:
    """The frames of each episode."""
    ends = np.cumsum(lengths)[:-1]
    parts = {name: np.split(column, ends) for name, column in columns.items()}
    return [{name: part[number] for name, part in parts.items()} for number in range(len(lengths))]


def _episodes(recordings: Sequence[DetectedLog], columns: Columns, lengths: Sequence[int]) -> Columns:
    ends = np.cumsum(lengths)
    zeros = np.zeros(len(lengths), np.int64)
    places = ("data/chunk_index", "data/file_index", "meta/episodes/chunk_index", "meta/episodes/file_index")
    tasks = np.empty(len(lengths), object)
    tasks[:] = [[_task(recording)] for recording in recordings]
    return {
        "episode_index": np.arange(len(lengths)),
        "tasks": tasks,
        "length": np.array(lengths),
        "dataset_from_index": ends - lengths,
        "dataset_to_index": ends,
        **_statistics_of_each(_split(columns, lengths)),
        **dict.fromkeys(places, zeros),
    }


def _statistics_of_each(episodes: Sequence[Columns]) -> Columns:
    """A column of each statistic of each feature, as LeRobot's own writer has them."""
    statistics_of_each = [{name: _statistics(column) for name, column in columns.items()} for columns in episodes]
    return {
        f"stats/{name}/{statistic}": np.array([each[name][statistic] for each in statistics_of_each])
        for name, statistics in statistics_of_each[0].items()
        for statistic in statistics
    }


def _info(columns: Columns, lengths: Sequence[int], tasks: int, rate: int) -> dict[str, Any]:
    return {
        "codebase_version": VERSION,
        "robot_type": None,
        "total_episodes": len(lengths),
        "total_frames": sum(lengths),
        "total_tasks": tasks,
        "chunks_size": CHUNK_SIZE,
        **FILE_SIZES_MB,
        "fps": rate,
        "splits": {"train": f"0:{len(lengths)}"},
        "data_path": DATA_PATH,
        "video_path": None,
        "features": {name: _feature(column) for name, column in columns.items()},
    }


def _feature(column: NDArray[Any]) -> dict[str, Any]:
    return {"dtype": str(column.dtype), "shape": list(column.shape[1:]) or [1], "names": None}


def _statistics(column: NDArray[Any]) -> dict[str, Any]:
    """Over all frames, of each entry of a frame."""
    values = column.reshape(len(column), *(column.shape[1:] or (1,))).astype(np.float64)
    over = {name: getattr(values, name)(axis=0).tolist() for name in ("min", "max", "mean", "std")}
    quantiles = np.quantile(values, list(QUANTILES.values()), axis=0).tolist()
    return {**over, **dict(zip(QUANTILES, quantiles, strict=True)), "count": [len(column)]}


def _write_table(path: Path, parts: Sequence[Columns], notes: dict[bytes, str] | None = None) -> None:
    """Write the parts one below the other, each as a group of rows, so that one is read without the others."""
    path.parent.mkdir(parents=True, exist_ok=True)
    tables = [pa.table({name: _nested(column) for name, column in part.items()}, metadata=notes) for part in parts]
    with pq.ParquetWriter(path, tables[0].schema, compression="zstd") as writer:
        for table in tables:
            writer.write_table(table)


def _nested(column: NDArray[Any]) -> pa.Array:
    """Rows of lists, nested as the array's axes are: of any length, as LeRobot's own writer leaves them."""
    if column.dtype == object:
        return pa.array(list(column))
    found = pa.array(column.reshape(-1))
    for length in reversed(column.shape[1:]):
        found = pa.ListArray.from_arrays(np.arange(0, len(found) + 1, length, dtype=np.int32), found)
    return found


def _write_tasks(path: Path, tasks: Sequence[str]) -> None:
    """A pandas table whose index are the tasks."""
    import pandas as pd

    path.parent.mkdir(parents=True, exist_ok=True)
    pd.DataFrame({"task_index": range(len(tasks))}, index=pd.Index(tasks, name="task")).to_parquet(path)


def _write_json(path: Path, content: dict[str, Any]) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(content, indent=4, allow_nan=False), encoding="utf-8")
