"""Paths that cannot be the data folder, at each command that opens it."""

import os
from pathlib import Path

import pytest

from service.cli import main
from service.cli.exit_codes import INPUT_REFUSED
from service.processes import data_folder
from service.processes.data_folder import UnusableFolder

ALLOWED = "allowed: a folder that the service's user may read and write, or a path at which it may make one"
FILE, TOO_LONG = "is a file, or in one", "is too long for the file system"
BAD = [("FILE", FILE), ("FILE/data", FILE), ("a" * 300, TOO_LONG)]


@pytest.fixture
def folder(tmp_path: Path, request: pytest.FixtureRequest) -> Path:
    (tmp_path / "FILE").write_bytes(b"no folder")
    return tmp_path / str(request.param)


@pytest.mark.parametrize(("folder", "why"), BAD, indirect=["folder"], ids=["file", "in a file", "too long"])
@pytest.mark.parametrize("command", ["serve", "worker"])
def test_a_service_names_the_setting_and_its_value(
    folder: Path,
    why: str,
    command: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    caplog: pytest.LogCaptureFixture,
) -> None:
    monkeypatch.setattr("service.cli.running._prepare", lambda _: None)  # the log of this process stays its own
    with pytest.raises(SystemExit) as ending:
        main([command, "--data-folder", str(folder)])
    told = capsys.readouterr().err + caplog.text
    assert (ending.value.code, "Traceback" in told) == (INPUT_REFUSED, False)
    assert f"STICTION_DATA_FOLDER (--data-folder) is {str(folder)[:200]!r}, which {why}; {ALLOWED}" in told


@pytest.mark.parametrize(("folder", "why"), BAD, indirect=["folder"], ids=["file", "in a file", "too long"])
@pytest.mark.parametrize("command", ["upgrade", "check", "current"])
def test_a_command_on_the_database_does_so_too(
    folder: Path, why: str, command: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("STICTION_DATA_FOLDER", str(folder))
    with pytest.raises(SystemExit) as ending:
        main(["db", command])
    told = capsys.readouterr().err
    assert (ending.value.code, "Traceback" in told) == (INPUT_REFUSED, False)
    assert f"which {why}; {ALLOWED}" in told


def test_a_folder_of_another_user_is_refused_and_one_below_missing_ones_is_made(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    data_folder.prepare(tmp_path / "not" / "there" / "yet")
    assert (tmp_path / "not" / "there" / "yet").is_dir()
    monkeypatch.setattr(os, "access", lambda *_: False)  # as for an unprivileged user
    with pytest.raises(UnusableFolder, match="which this user may not read and write"):
        data_folder.prepare(tmp_path)


def test_a_folder_that_cannot_be_made_is_refused() -> None:
    with pytest.raises(UnusableFolder, match="is in a folder that is not there and cannot be made"):
        data_folder.prepare(Path("/proc/stiction/data"))
    with pytest.raises(UnusableFolder, match=r"is 'a\\x00b', which has a NUL character"):
        data_folder.prepare(Path("a\0b"))
