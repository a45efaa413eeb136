"""The command that writes logs for others' tools, and what it refuses."""

from dataclasses import replace
from pathlib import Path

import pytest

from service import exports, formats
from service.cli import main
from service.exports import Recording
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


def test_several_logs_in_a_file_of_one_are_refused(recording: Recording, tmp_path: Path) -> None:
    with pytest.raises(InvalidInput, match="logs is 2; allowed: one log a file for foxglove"):
        exports.write([recording, recording], tmp_path / "log.mcap", "foxglove")
    assert not (tmp_path / "log.mcap").exists()


def test_an_export_that_breaks_off_leaves_the_file_of_before(recording: Recording, tmp_path: Path) -> None:
    (tmp_path / "log.mcap").write_text("before")
    torn = Recording(recording.log, replace(recording.history, stick_ratio=recording.history.stick_ratio[:10]), "torn")
    with pytest.raises(IndexError, match="index 10 is out of bounds"):
        exports.write([torn], tmp_path / "log.mcap", "foxglove")
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == {"log.mcap": "before"}


def test_a_missing_library_is_named_with_what_brings_it(
    recording: Recording, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    import sys

    monkeypatch.setitem(sys.modules, "mcap.writer", None)
    monkeypatch.delitem(sys.modules, "service.exports.foxglove", raising=False)
    with pytest.raises(formats.UnsupportedFormat, match=r"pip install 'stiction\[formats\]'"):
        exports.write([recording], tmp_path / "log.mcap", "foxglove")
