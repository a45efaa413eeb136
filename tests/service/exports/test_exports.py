"""The command that writes logs for others' tools, and what it refuses."""

import json
from collections.abc import Callable
from dataclasses import replace
from importlib.resources import files
from pathlib import Path

import pytest

from service import exports, formats
from service.cli import main
from service.cli.exit_codes import INPUT_REFUSED
from service.exports import DetectedLog
from service.formats import writing
from slipcore import GraspLog, InvalidInput
from stiction_client import container


@pytest.fixture
def file(ramp: GraspLog, tmp_path: Path) -> Path:
    container.write(ramp, tmp_path / "grasp.npz")
    return tmp_path / "grasp.npz"


@pytest.mark.parametrize(("output", "written"), [("log.mcap", "log.mcap"), ("grasps", "grasps/meta/info.json")])
def test_the_ending_of_a_name_says_for_whom(
    file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], output: str, written: str
) -> None:
    with pytest.raises(SystemExit) as left:
        main(["export", str(file), "-o", str(tmp_path / output)])
    assert left.value.code == 0
    assert (tmp_path / written).is_file()
    assert "82 frames of 1 grasp(s)" in capsys.readouterr().out


def test_another_ending_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InvalidInput, match=r"output is log\.txt; allowed: a name with the ending \.mcap, "):
        exports.target_of(tmp_path / "log.txt")


def test_several_logs_in_a_file_of_one_are_refused(recording: DetectedLog, tmp_path: Path) -> None:
    with pytest.raises(InvalidInput, match="logs is 2; allowed: one log a file for foxglove"):
        exports.write([recording, recording], tmp_path / "log.mcap", "foxglove")
    assert not (tmp_path / "log.mcap").exists()


def test_an_export_that_breaks_off_leaves_nothing(recording: DetectedLog, tmp_path: Path) -> None:
    torn = DetectedLog(
        recording.log, replace(recording.history, stick_ratio=recording.history.stick_ratio[:10]), "torn"
    )
    with pytest.raises(IndexError, match="index 10 is out of bounds"):
        exports.write([torn], tmp_path / "log.mcap", "foxglove")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("name", ["log.mcap", "log.rrd", "grasps"])
def test_what_is_there_is_not_replaced(recording: DetectedLog, tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_text("mine")
    with pytest.raises(InvalidInput, match=r"output is .*; allowed: a (file|folder) that is .*not there yet"):
        exports.write([recording], tmp_path / name, exports.target_of(tmp_path / name))
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == {name: "mine"}


@pytest.mark.parametrize("link", [None, Path.symlink_to, Path.hardlink_to])
def test_a_recording_is_not_exported_over_itself(
    file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], link: Callable[[Path, Path], None] | None
) -> None:
    recording = tmp_path / "recording.mcap"
    writing.write(formats.read(file), recording, "mcap")
    before, output = recording.read_bytes(), recording
    if link is not None:
        output = tmp_path / "link.mcap"
        link(output, recording)
    with pytest.raises(SystemExit) as left:
        main(["export", str(recording), "-o", str(output)])
    assert left.value.code == INPUT_REFUSED
    assert "allowed: a file that is not there yet" in capsys.readouterr().err
    assert recording.read_bytes() == before


def test_the_folder_that_one_is_in_is_refused_by_name(
    recording: DetectedLog, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InvalidInput, match=r"output is \., the folder that you are in; allowed: another"):
        exports.write([recording], Path(), exports.target_of(Path()))
    assert tmp_path.is_dir()


@pytest.mark.parametrize("link", [None, Path.symlink_to, Path.hardlink_to])
@pytest.mark.parametrize("command", ["convert", "report", "simulate", "calibrate"])
def test_no_command_writes_over_what_it_reads(
    file: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    link: Callable[[Path, Path], None] | None,
    command: str,
) -> None:
    source = file
    if command == "simulate":
        source = tmp_path / "scene.toml"
        source.write_bytes((files("slipcore.contact") / "scenes" / "lifting_10N.toml").read_bytes())
    before, output = source.read_bytes(), source
    if link is not None:
        output = tmp_path / "link.npz"
        link(output, source)
    options = {"convert": [str(output)], "calibrate": ["-o", str(output), "--known-force", "1"]}
    words = ["sensors", "calibrate"] if command == "calibrate" else [command]
    with pytest.raises(SystemExit) as left:
        main([*words, str(source), *options.get(command, ["--output", str(output)])])
    assert left.value.code == INPUT_REFUSED
    assert "which is read; allowed: another file" in capsys.readouterr().err
    assert source.read_bytes() == before


def test_a_file_inside_of_a_folder_that_is_read_is_not_replaced(
    recording: DetectedLog, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    exports.write([recording], tmp_path / "grasps", "lerobot")
    data = tmp_path / "grasps" / "data" / "chunk-000" / "file-000.parquet"
    before = data.read_bytes()
    with pytest.raises(SystemExit) as left:
        main(["convert", str(tmp_path / "grasps"), str(data)])
    assert left.value.code == INPUT_REFUSED
    assert "which is read" in capsys.readouterr().err
    assert data.read_bytes() == before


def test_a_missing_library_is_named_with_what_brings_it(
    recording: DetectedLog, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    import sys

    monkeypatch.setitem(sys.modules, "mcap.writer", None)
    monkeypatch.delitem(sys.modules, "service.exports.foxglove", raising=False)
    with pytest.raises(formats.UnsupportedFormat, match=r"pip install 'stiction\[formats\]'"):
        exports.write([recording], tmp_path / "log.mcap", "foxglove")


@pytest.mark.parametrize(("metadata", "is_told"), [({}, False), ({"force": "reconstructed"}, True)])
def test_of_how_many_grasps_forces_are_reconstructed_is_printed(
    recording: DetectedLog, tmp_path: Path, capsys: pytest.CaptureFixture[str], metadata: dict[str, str], is_told: bool
) -> None:
    container.write(replace(recording.log, metadata=metadata), tmp_path / "log.npz")
    with pytest.raises(SystemExit):
        main(["export", str(tmp_path / "log.npz"), "-o", str(tmp_path / "dataset")])
    told = "forces of 1 of 1 grasp(s) are reconstructed from displacement"
    assert (told in capsys.readouterr().out) is is_told
    with pytest.raises(SystemExit):
        main(["export", str(tmp_path / "log.npz"), "-o", str(tmp_path / "other"), "--json"])
    made = json.loads(capsys.readouterr().out)
    assert made == {
        "output": str(tmp_path / "other"),
        "target": "lerobot",
        "frames": len(recording.log),
        "grasps": 1,
        "with_reconstructed_forces": int(is_told),
    }
