"""Which logs a command line names."""

from pathlib import Path

import pytest
import typer

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
