"""Which logs a command line names."""

from pathlib import Path

import pytest
import typer

from service import formats
from service.cli.sources import found


def test_a_folder_stands_for_its_files_in_order_without_hidden_ones(tmp_path: Path) -> None:
    for name in ("b.npz", "a.npz", ".hidden.npz"):
        (tmp_path / name).touch()
    (tmp_path / "folder").mkdir()
    assert [source.name for source in found([tmp_path], None)] == ["a.npz", "b.npz"]


def test_a_folder_of_hidden_files_alone_is_refused(tmp_path: Path) -> None:
    (tmp_path / ".hidden.npz").touch()
    with pytest.raises(typer.BadParameter, match="has no files in it"):
        found([tmp_path], None)


def test_what_is_named_comes_in_its_order_and_a_recording_is_one_log(tmp_path: Path) -> None:
    for folder, name in (("bag", "metadata.yaml"), ("tac", "index.npy"), ("logs", "1.npz")):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / name).touch()
        (tmp_path / folder / "more.txt").touch()
    (tmp_path / "alone.npz").touch()
    named = [tmp_path / name for name in ("logs", "bag", "alone.npz", "tac", "absent.npz")]
    told = [source.name for source in found(named, None)]
    assert told == ["1.npz", "more.txt", "bag", "alone.npz", "tac", "absent.npz"]


def test_a_file_is_handed_on_as_it_is_with_what_its_upload_says_of_it(tmp_path: Path) -> None:
    (tmp_path / "mapping.json").write_text('{"time": "t", "displacement": "u"}')
    (source,) = found([tmp_path / "a.npz"], tmp_path / "mapping.json")
    path, options = source.log()
    assert path == tmp_path / "a.npz"
    assert (options["mapping"]["time"], options["mapping"]["displacement"]) == ("t", "u")
    (alone,) = found([tmp_path / "a.npz"], None, scale=2.0, rest="first")
    assert alone.log() == (tmp_path / "a.npz", {"mapping": None, "scale": 2.0, "rest": "first"})


def test_a_log_is_read_here_where_its_rest_is_a_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[object] = []
    monkeypatch.setattr(formats, "read", lambda path, **given: asked.append((path, given)))
    (source,) = found([tmp_path / "a.npz"], None, scale=2.0, rest=tmp_path / "rest.npz")
    assert source.log()[1] == {}
    assert asked == [(tmp_path / "a.npz", {"mapping": None, "scale": 2.0, "rest": tmp_path / "rest.npz"})]
