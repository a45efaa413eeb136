"""No reader crashes, hangs or takes memory, whatever it is given: mutations of real files."""

import json
import os
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

LIMIT_SECONDS = 5.0
"""s of computing after which a file's process is ended, as the service does with a small file (service/reading.py)."""

LOOK_SECONDS, MOST_LOOKS = 0.5, 240
"""s between two looks at a process, and how many may show one case, however little it computes.

Computing and looks are counted and not time: a machine may be busy, and a campaign stopped for a while.
"""

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
    write.protobuf_mcap(robot_log, folder / "protobuf_mcap", use_chunking=False)
    write.hdf5(log, folder / "hdf5")
    parquet.write(log, folder / "parquet")
    write.lerobot(robot_log, folder / "lerobot")
    write.json(log, folder / "json")
    given = {"lerobot": {"episode": 0, "pitch": 1e-3}}
    moved = {"displacement": [f"markers.moved.{axis}" for axis in "xyz"], "force": "markers.force"}
    given["protobuf_mcap"] = {"topic": "/tactile", "grid": [3, 4], "pitch": 1e-3, "time": "stamp", **moved}
    plain = {"topic": "/tactile", "displacement": "displacement", "position": "rest"}
    given |= dict.fromkeys(("bag1", "bag1plain", "bag2", "bagmcap"), write.mapping)
    given |= dict.fromkeys(("json_mcap", "plain_mcap"), plain)
    for name, mapping in given.items():
        (folder / f"{name}.mapping").write_text(json.dumps(mapping))
    return folder


def fuzz(seeds: Path, count: int, first: int, journal: Path) -> dict[str, Any]:
    """Run the cases, going on after each of which the process dies or at which it has to be ended.

    ``found`` is what is wrong with a reader. ``ended`` are files that keep a library busy for ever inside its C code,
    where nothing but the end of the process helps: the service refuses them so.
    """
    last, found, ended, outcomes = first + count, [], [], Counter[str]()
    slowest, grown = 0.0, 0
    files = sorted(path for path in seeds.iterdir() if path.suffix != ".mapping")
    plain = {path.name for path in files if formats.FORMATS[formats.identify(path)].plain}
    while first < last:
        how = watched([sys.executable, str(SCRIPT), str(seeds), str(last - first), str(first), str(journal)], journal)
        told = [line.split("\t") for line in journal.read_text().splitlines()]
        for outcome, seconds, bytes_grown in told:
            name = files[first % len(files)].name
            if outcome not in {"log", "refused"}:
                found.append([first, name, outcome])
            outcomes[outcome.partition(":")[0]] += 1
            slowest, grown, first = max(slowest, float(seconds)), max(grown, int(bytes_grown)), first + 1
        if first < last:
            name = files[first % len(files)].name
            (ended if how == "ended" and name not in plain else found).append([first, name, how])
            outcomes[how.partition(" ")[0]] += 1
            first += 1
    return {"outcomes": dict(outcomes), "found": found, "ended": ended, "slowest": slowest, "grown": grown}


def watched(command: list[str], journal: Path) -> str:
    """How the process ended: with an exit code, or "ended" here at a case that does not end."""
    journal.unlink(missing_ok=True)
    with subprocess.Popen(command) as process:
        done, begun, looks = -1, 0.0, 0
        while True:
            try:
                return f"died with {process.wait(LOOK_SECONDS)}"
            except subprocess.TimeoutExpired:
                now = journal.stat().st_size if journal.exists() else -1
                seconds = computed(process.pid)
                if now != done:
                    done, begun, looks = now, seconds, 0
                looks += 1
                if (done >= 0 and seconds - begun > LIMIT_SECONDS) or looks > MOST_LOOKS:
                    process.kill()
                    return "ended"


def computed(pid: int) -> float:
    """s that a process has computed."""
    fields = Path(f"/proc/{pid}/stat").read_text(encoding="ascii").rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def test_some_hundred_mutated_files_give_logs_or_named_errors(seeds: Path, tmp_path: Path) -> None:
    result = fuzz(seeds, 300, 0, tmp_path / "journal")
    assert result["found"] == []
    assert result["outcomes"]["refused"] > 150


@pytest.mark.long
def test_a_hundred_thousand_mutated_files_give_logs_or_named_errors(seeds: Path, tmp_path: Path) -> None:
    result = fuzz(seeds, 100_000, 0, tmp_path / "journal")
    print(json.dumps(result))  # noqa: T201  (for docs/long-tests.md)
    assert result["found"] == []
    assert sum(result["outcomes"].values()) == 100_000
    assert len(result["ended"]) < 10


@pytest.mark.parametrize("path", sorted(set(DATA.glob("*")) - set(DATA.glob("endless-*"))), ids=lambda path: path.name)
def test_what_once_broke_a_reader_is_refused(path: Path, write: SimpleNamespace) -> None:
    """Named FORMAT-what-it-broke."""
    name = path.name.partition("-")[0]
    mapping = json.dumps(write.mapping) if name.startswith("rosbag") else None
    with pytest.raises(InvalidInput):
        formats.read(path, formats.FORMATS[name].content_type, mapping=mapping)
