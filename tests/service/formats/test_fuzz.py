"""No reader crashes, hangs or takes memory, whatever it is given: mutations of real files."""

import json
import subprocess
import sys
import zipfile
from collections import Counter
from collections.abc import Callable, Mapping
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from mcap.writer import CompressionType
from rosbags.rosbag1 import Writer as Bag1
from rosbags.rosbag2 import StoragePlugin

from service import formats
from service.formats import mcap, parquet
from slipcore import GraspLog, InvalidInput
from stiction_client import container

HANG_SECONDS = 20.0
"""s without progress after which a process is ended: four times what one file may take, for a busy machine."""

SCRIPT = Path(__file__).with_name("fuzz_readers.py")
DATA = Path(__file__).parents[2] / "data/hostile"
DOTS = Path(__file__).with_name("tracked_dots.csv")


@pytest.fixture
def seeds(
    log: GraspLog, robot_log: GraspLog, write: SimpleNamespace, recording_fields: Mapping[str, np.ndarray],
    zip_of: Callable[..., Path], tmp_path: Path,
) -> Path:  # fmt: skip
    """A small real file of each format, in several of its shapes."""
    folder = tmp_path / "seeds"
    folder.mkdir()
    container.write(log, folder / "npz")
    zip_of({f"SN/{name}.npy": array for name, array in recording_fields.items()}, zipfile.ZIP_DEFLATED).rename(
        folder / "tac3d"
    )
    (folder / "markers").write_bytes(b"".join(DOTS.read_bytes().splitlines(keepends=True)[:400]))
    write.bag1(robot_log, folder / "bag1", Bag1.CompressionFormat.LZ4)
    write.bag1(robot_log, folder / "bag1plain")
    bag2 = write.bag2(robot_log, tmp_path / "bag2")
    next(bag2.glob("*.db3")).rename(folder / "bag2")
    bagged = write.bag2(robot_log, tmp_path / "bagged", StoragePlugin.MCAP)
    next(bagged.glob("*.mcap")).rename(folder / "bagmcap")
    mcap.write(log, folder / "mcap")
    write.json_mcap(robot_log, folder / "json_mcap", compression=CompressionType.LZ4)
    write.json_mcap(robot_log, folder / "plain_mcap", use_chunking=False)
    write.hdf5(log, folder / "hdf5")
    parquet.write(log, folder / "parquet")
    write.lerobot(robot_log, folder / "lerobot")
    write.json(log, folder / "json")
    given = {"lerobot": {"episode": 0, "pitch": 1e-3}}
    plain = {"topic": "/tactile", "displacement": "displacement", "position": "rest"}
    given |= dict.fromkeys(("bag1", "bag1plain", "bag2", "bagmcap"), write.mapping)
    given |= dict.fromkeys(("json_mcap", "plain_mcap"), plain)
    for name, mapping in given.items():
        (folder / f"{name}.mapping").write_text(json.dumps(mapping))
    return folder


def fuzz(seeds: Path, count: int, first: int, progress: Path) -> dict[str, Any]:
    """Run the cases, going on after each that ends the process or has to be ended, which is a finding."""
    last, found, outcomes = first + count, [], Counter[str]()
    slowest, grown = 0.0, 0
    files = sorted(path for path in seeds.iterdir() if path.suffix != ".mapping")
    while first < last:
        command = [sys.executable, SCRIPT, seeds, str(last - first), str(first), progress]
        code, told = watched([str(part) for part in command], progress)
        if code == 0:
            result = json.loads(told)
            outcomes.update(result["outcomes"])
            found += result["found"]
            slowest, grown = max(slowest, result["slowest"]), max(grown, result["grown"])
            break
        number = int(progress.read_text())
        found.append([number, files[number % len(files)].name, f"ended with {code}"])
        outcomes["ended"] += 1
        first = number + 1
    return {"outcomes": dict(outcomes), "found": found, "slowest": slowest, "grown": grown}


def watched(command: list[str], progress: Path) -> tuple[int, str]:
    """Exit code and output; a process whose case does not end, whatever its own alarm, is killed."""
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        case = ""
        while True:
            try:
                told, _ = process.communicate(timeout=HANG_SECONDS)
                return process.returncode, told
            except subprocess.TimeoutExpired:
                before, case = case, progress.read_text() if progress.exists() else ""
                if case and case == before:
                    process.kill()


def test_some_hundred_mutated_files_give_logs_or_named_errors(seeds: Path, tmp_path: Path) -> None:
    result = fuzz(seeds, 300, 0, tmp_path / "progress")
    assert result["found"] == []
    assert result["outcomes"]["refused"] > 150


@pytest.mark.long
def test_a_hundred_thousand_mutated_files_give_logs_or_named_errors(
    seeds: Path, tmp_path: Path, record_property: Callable[[str, object], None]
) -> None:
    result = fuzz(seeds, 100_000, 1000, tmp_path / "progress")
    record_property("fuzz", result)
    (tmp_path / "result.json").write_text(json.dumps(result))
    in_c = [entry for entry in result["found"] if entry[1] == "hdf5" and entry[2].startswith("ended")]
    assert [entry for entry in result["found"] if entry not in in_c] == []
    assert len(in_c) < 10  # the C library's own; the service ends its process (service/reading.py)


@pytest.mark.parametrize("path", sorted(set(DATA.glob("*")) - set(DATA.glob("endless-*"))), ids=lambda path: path.name)
def test_what_once_broke_a_reader_is_refused(path: Path, write: SimpleNamespace) -> None:
    """Named FORMAT-what-it-broke."""
    name = path.name.partition("-")[0]
    mapping = json.dumps(write.mapping) if name.startswith("rosbag") else None
    with pytest.raises(InvalidInput):
        formats.read(path, formats.FORMATS[name].content_type, mapping=mapping)
