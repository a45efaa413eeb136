"""HDF5 files: what is read of them, and how much of it."""

import json
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from service.formats import hdf5, mapping
from slipcore import GraspLog, InvalidInput


@pytest.fixture
def file(tmp_path: Path) -> Any:
    with h5py.File(tmp_path / "log", "w") as opened:
        opened["time"] = np.arange(3.0)
        opened["deep/displacement"] = np.zeros((3, 1, 2, 3))
        opened["deep/position"] = [[[0.0, 0.0, 0.0], [1e-3, 0.0, 0.0]]]
        opened.attrs["element_area"] = 1e-6
        opened["deep"].attrs["sensor"] = "left"
        yield opened


MAPPED = {"displacement": "/deep/displacement", "position": "deep//position", "sensor": "deep@sensor"}


def read(file: Any, told: Any = None) -> GraspLog:
    file.flush()
    name = file.filename
    file.close()
    return hdf5.read(Path(name), None if told is None else mapping.parse(json.dumps(told)))


def test_members_are_datasets_by_their_paths_and_attributes(file: Any) -> None:
    log = read(file, MAPPED)
    assert (len(log), log.grid, log.element_area, log.sensor) == (3, (1, 2), 1e-6, "left")


def test_a_file_says_itself_what_is_what(file: Any) -> None:
    file.attrs["stiction_mapping"] = json.dumps(MAPPED)
    assert read(file).sensor == "left"


def test_bytes_of_all_datasets_are_counted_together(file: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    whole = 3 * 8 + 3 * 6 * 8 + 6 * 8
    monkeypatch.setattr(hdf5, "MAX_CONTENT_BYTES", whole)
    name = file.filename
    assert len(read(file, MAPPED)) == 3
    monkeypatch.setattr(hdf5, "MAX_CONTENT_BYTES", whole - 1)
    with (
        h5py.File(name, "a") as again,
        pytest.raises(InvalidInput, match=f"is .* bytes by its header; allowed: at most {whole - 1} in all"),
    ):
        read(again, MAPPED)


def test_a_chunk_may_be_as_large_as_may_be(file: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    del file["time"]
    file.create_dataset("time", data=np.arange(3.0), maxshape=(None,), chunks=(10,))
    name = file.filename
    monkeypatch.setattr(hdf5, "MAX_CHUNK_BYTES", 80)
    assert len(read(file, MAPPED)) == 3
    monkeypatch.setattr(hdf5, "MAX_CHUNK_BYTES", 79)
    with h5py.File(name, "a") as again, pytest.raises(InvalidInput, match="time is in chunks of 80 bytes; allowed: at"):
        read(again, MAPPED)


@pytest.mark.parametrize(
    "options", [{"compression": "gzip"}, {"compression": "lzf", "shuffle": True, "fletcher32": True}]
)
def test_common_filters_are_unpacked(file: Any, options: Any) -> None:
    del file["time"]
    file.create_dataset("time", data=np.arange(3.0), **options)
    assert read(file, MAPPED).time.tolist() == [0.0, 1.0, 2.0]


def test_an_attribute_is_as_long_as_a_mapping_may_be(file: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mapping, "MAX_MAPPING_BYTES", 8)
    assert hdf5._attribute(file, "element_area") == 1e-6
    monkeypatch.setattr(mapping, "MAX_MAPPING_BYTES", 7)
    with pytest.raises(InvalidInput, match="element_area is 8 bytes; allowed: at most 7"):
        hdf5._attribute(file, "element_area")
    assert hdf5._attribute(file, "none") is None
    assert hdf5._attribute(None, "none") is None


@pytest.mark.parametrize(
    ("kind", "told"),
    [
        ("soft", "deep/soft is a SoftLink; allowed: a dataset in this file, not a link"),
        ("group", r"time is a group \(deep\); allowed: a dataset"),
        ("absent", "time is not there"),
        ("within", "time is not there"),
    ],
)
def test_a_path_leads_to_a_dataset_of_this_file(file: Any, kind: str, told: str) -> None:
    file["deep/soft"] = h5py.SoftLink("/time")
    path = {"soft": "deep/soft", "group": "deep", "absent": "deep/absent", "within": "time/more"}[kind]
    with pytest.raises(InvalidInput, match=told):
        read(file, MAPPED | {"time": path})


def test_text_in_bytes_is_read_as_far_as_it_is_text() -> None:
    assert hdf5._plain("sensor", "né".encode()).item() == "né"
    assert hdf5._plain("sensor", b"n\xff").item() == "n\ufffd"
    with pytest.raises(
        InvalidInput, match=r"sensor is of dtype complex128; allowed: numbers, truth values or one text"
    ):
        hdf5._plain("sensor", 1j)
