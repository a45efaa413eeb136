"""Tables with a row a frame: their footers, episodes and rows, to the last one."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from service.formats import parquet
from service.formats.mapping import parse
from slipcore import GraspLog, InvalidInput

PLACE = np.zeros((1, 2, 3))
PLACE[0, 1, 0] = 1e-3
BESIDE = {"position": {"value": PLACE.tolist()}, "element_area": {"value": 1e-6}}


def table(frames: int, **columns: Any) -> dict[str, Any]:
    """Frames of two elements that move along x by so many tenths of 1 µm as their number."""
    moved = np.zeros((frames, 1, 2, 3))
    moved[..., 0] = 1e-7 * np.arange(frames)[:, None, None]
    return {"time": np.arange(frames) / 10.0, "displacement": pa.array(moved.tolist()), **columns}


def read(columns: dict[str, Any], path: Path, mapping: Any = None, **options: Any) -> GraspLog:
    pq.write_table(pa.table(columns), path, **options)
    return parquet.read(path, parse(json.dumps(BESIDE if mapping is None else BESIDE | mapping)))


def test_a_row_is_a_frame(tmp_path: Path) -> None:
    log = read(table(5), tmp_path / "log", row_group_size=2)
    assert log.time.tolist() == [0.0, 0.1, 0.2, 0.3, 0.4]
    assert np.allclose(log.displacement[:, 0, 1, 0], 1e-7 * np.arange(5), rtol=1e-12, atol=0.0)


def test_more_rows_than_are_read_at_once_are_all_there(tmp_path: Path) -> None:
    log = read(table(2049), tmp_path / "log")
    assert np.allclose(log.displacement[:, 0, 0, 0], 1e-7 * np.arange(2049), rtol=1e-12, atol=0.0)


def test_a_row_that_differs_is_told_by_its_number(tmp_path: Path) -> None:
    columns = table(1500)
    rows = columns["displacement"].to_pylist()
    rows[1100] = [[[0.0, 0.0, 0.0]]]
    with pytest.raises(InvalidInput, match="displacement is a list of another length at row 1100; allowed: 2 entries"):
        read(columns | {"displacement": pa.array(rows)}, tmp_path / "log")
    rows[1100] = None
    with pytest.raises(InvalidInput, match="displacement is null in the rows from 1024 on; allowed: a list in each"):
        read(columns | {"displacement": pa.array(rows)}, tmp_path / "log")
    rows[1024:] = [[[[0.0, 0.0, 0.0]]]] * 476
    with pytest.raises(InvalidInput, match="displacement is of rows of different lengths; allowed: lists of one"):
        read(columns | {"displacement": pa.array(rows)}, tmp_path / "log")


def test_an_episode_s_rows_need_not_stand_together(tmp_path: Path) -> None:
    columns = table(9, episode_index=[0, 3, 0, 3, 3, 7, 7, 0, 3])
    log = read(columns, tmp_path / "log", {"episode": 3}, row_group_size=2)
    assert np.allclose(log.time, [0.1, 0.3, 0.4, 0.8])
    assert np.allclose(log.displacement[:, 0, 0, 0], [1e-7, 3e-7, 4e-7, 8e-7], rtol=1e-12, atol=0.0)


@pytest.mark.parametrize(("mapping", "value"), [({}, "missing"), ({"episode": 2}, "2")])
def test_an_episode_is_one_of_those_that_there_are(tmp_path: Path, mapping: Any, value: str) -> None:
    with pytest.raises(InvalidInput, match=f"^episode is {value}; allowed: one of 0, 1$"):
        read(table(4, episode_index=[0, 0, 1, 1]), tmp_path / "log", mapping)
    many = ", ".join(map(str, range(3, 23)))
    with pytest.raises(InvalidInput, match=f"^episode is {value}; allowed: one of {many}, …$"):
        read(table(21, episode_index=range(3, 24)), tmp_path / "log", mapping)
    with pytest.raises(InvalidInput, match=f"^episode is {value}; allowed: one of {many}$"):
        read(table(20, episode_index=range(3, 23)), tmp_path / "log", mapping)


def test_the_only_episode_needs_no_number(tmp_path: Path) -> None:
    assert len(read(table(4, episode_index=[5] * 4), tmp_path / "log")) == 4


def test_rows_are_counted_before_they_are_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(parquet, "MAX_ROWS", 4)
    assert len(read(table(4), tmp_path / "log")) == 4
    with pytest.raises(InvalidInput, match="file is 5 rows by its header; allowed: at most 4 rows"):
        read(table(5), tmp_path / "log")


def test_bytes_of_all_columns_are_counted_together(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    columns = table(100)
    taken = 100 * 8 + pa.table({"displacement": columns["displacement"]}).nbytes
    monkeypatch.setattr(parquet, "MAX_CONTENT_BYTES", taken + 100)
    assert len(read(columns, tmp_path / "log")) == 100
    monkeypatch.setattr(parquet, "MAX_CONTENT_BYTES", taken - 100)
    with pytest.raises(InvalidInput, match=f"file is more than {taken - 100} bytes; allowed: at most {taken - 100}"):
        read(columns, tmp_path / "log")


@pytest.mark.parametrize("change", ["cut", "other end", "long footer", "tiny"])
def test_a_footer_is_where_it_should_be(tmp_path: Path, change: str) -> None:
    pq.write_table(pa.table(table(4)), path := tmp_path / "log")
    content = path.read_bytes()
    path.write_bytes(
        {
            "cut": content[:-1],
            "other end": content[:-4] + b"PAR2",
            "long footer": content[:-8] + len(content).to_bytes(4, "little") + b"PAR1",
            "tiny": b"PAR1",
        }[change]
    )
    with pytest.raises(InvalidInput, match=r"file is a truncated or damaged Parquet .*; allowed: a complete Parquet"):
        parquet.read(path, parse(json.dumps(BESIDE)))


def test_time_of_a_learner_s_table_is_its_timestamp_unless_it_has_a_finer_one(tmp_path: Path) -> None:
    columns = {f"observation.{name}": column for name, column in table(4).items()}
    fine = read(columns | {"timestamp": np.arange(4.0)}, tmp_path / "log")
    assert np.allclose(fine.time, [0.0, 0.1, 0.2, 0.3])
    del columns["observation.time"]
    coarse = read(columns | {"timestamp": np.arange(4.0)}, tmp_path / "log")
    assert coarse.time.tolist() == [0.0, 1.0, 2.0, 3.0]


def test_what_a_log_has_once_is_one_number_in_all_rows(tmp_path: Path) -> None:
    mapping = {"element_area": {"field": "area"}}
    log = read(table(3, area=[2e-6] * 3), tmp_path / "log", mapping)
    assert log.element_area == 2e-6
    with pytest.raises(InvalidInput, match="element_area is"):
        read(table(3, area=[2e-6, 2e-6, 3e-6]), tmp_path / "log", mapping)
