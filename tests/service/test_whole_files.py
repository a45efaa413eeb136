"""Files and folders that are written whole or not at all."""

from pathlib import Path

import pytest

from service.whole_files import write_whole


def half_a_file(path: Path) -> None:
    path.write_text("half")
    raise OSError("the disk is full")


def half_a_folder(path: Path) -> None:
    path.mkdir()
    half_a_file(path / "one")


@pytest.mark.parametrize("write", [half_a_file, half_a_folder])
def test_what_fails_half_way_leaves_what_was_there(tmp_path: Path, write: object) -> None:
    kept = tmp_path / "kept.txt"
    kept.write_text("before")
    with pytest.raises(OSError, match="the disk is full"):
        write_whole(kept, write)  # type: ignore[arg-type]
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == {"kept.txt": "before"}


def test_a_file_takes_the_place_of_the_one_before(tmp_path: Path) -> None:
    path = tmp_path / "new" / "file.txt"
    for text in ("one", "two"):
        assert write_whole(path, lambda beside, text=text: beside.write_text(text)) == path
        assert path.read_text() == text
    assert list(path.parent.iterdir()) == [path]


def test_a_folder_takes_the_place_of_an_empty_one_alone(tmp_path: Path) -> None:
    def write(beside: Path) -> None:
        (beside / "deep").mkdir(parents=True)

    folder = tmp_path / "folder"
    folder.mkdir()
    write_whole(folder, write)
    assert (folder / "deep").is_dir()
    with pytest.raises(OSError, match="folder"):
        write_whole(folder, write)
    assert [path.name for path in tmp_path.iterdir()] == ["folder"]


def test_what_a_killed_writer_left_does_not_stand_in_the_way(tmp_path: Path) -> None:
    for name, make in (("file", lambda path: path.write_text("old")), ("folder", lambda path: path.mkdir())):
        make(tmp_path / f"{name}.part")
        write_whole(tmp_path / name, lambda beside: beside.write_text("new"))
        assert (tmp_path / name).read_text() == "new"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["file", "folder"]
