"""Files and folders that are written whole or not at all."""

import os
from errno import ENOSPC
from pathlib import Path

import pytest

from service.whole_files import check_place, write_whole
from tests.forking import ForkedProcess


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


def test_what_is_named_like_a_part_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "file.part").write_text("mine")
    (tmp_path / "folder.part").mkdir()
    (tmp_path / "folder.part" / "notes").write_text("mine, too")
    for name in ("file", "folder"):
        write_whole(tmp_path / name, lambda beside: beside.write_text("new"))
        with pytest.raises(OSError, match="the disk is full"):
            write_whole(tmp_path / name, half_a_file)
        assert (tmp_path / name).read_text() == "new"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["file", "file.part", "folder", "folder.part"]
    assert (tmp_path / "file.part").read_text() == "mine"
    assert (tmp_path / "folder.part" / "notes").read_text() == "mine, too"


def test_two_writers_of_one_name_do_not_meet(tmp_path: Path) -> None:
    path = tmp_path / "file"

    def first(beside: Path) -> None:
        beside.write_text("first, ")
        write_whole(path, lambda other: other.write_text("second"))
        assert path.read_text() == "second"
        with beside.open("a") as stream:
            stream.write("whole")

    write_whole(path, first)
    assert {each.name: each.read_text() for each in tmp_path.iterdir()} == {"file": "first, whole"}


def killed(beside: Path) -> None:
    beside.write_text("half")
    os._exit(9)


def test_what_a_killed_writer_left_is_hidden_and_does_not_stand_in_the_way(tmp_path: Path) -> None:
    path = tmp_path / "file"
    writer = ForkedProcess(target=write_whole, args=(path, killed))
    writer.start()
    writer.join()
    assert writer.exitcode == 9
    (left,) = tmp_path.iterdir()
    assert left.name.startswith(".")
    write_whole(path, lambda beside: beside.write_text("new"))
    assert path.read_text() == "new"
    assert {each.name for each in tmp_path.iterdir()} == {"file", left.name}


def test_a_link_stays_one_and_leads_to_what_was_written(tmp_path: Path) -> None:
    (tmp_path / "far").mkdir()
    link = tmp_path / "link"
    link.symlink_to(tmp_path / "far" / "file")
    for text in ("one", "two"):
        assert write_whole(link, lambda beside, text=text: beside.write_text(text)) == link
        assert link.is_symlink()
        assert (tmp_path / "far" / "file").read_text() == text
    assert [path.name for path in (tmp_path / "far").iterdir()] == ["file"]


def test_a_device_is_not_replaced(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(FileExistsError, match="pipe is there and is neither a file nor a folder"):
        write_whole(tmp_path / "pipe", lambda beside: beside.write_text("new"))
    assert (tmp_path / "pipe").is_fifo()


def test_the_folder_that_one_works_in_is_refused_as_any_other(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(IsADirectoryError):
        write_whole(Path(), lambda beside: beside.write_text("new"))
    assert tmp_path.is_dir()


def test_where_no_file_may_be_made_the_one_that_was_to_be_is_named(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    for path in (tmp_path / "file" / "report.html", Path("/proc/report.html")):
        with pytest.raises(OSError) as refusal:  # noqa: PT011
            write_whole(path, half_a_file)
        assert refusal.value.filename == str(path)


def full(path: Path) -> None:
    path.write_text("half")
    raise OSError(ENOSPC, "No space left on device")


def missing(_: Path) -> None:
    Path("nowhere/input").read_text()


def test_of_a_full_disk_the_file_is_named_and_what_is_read_keeps_its_own_name(tmp_path: Path) -> None:
    with pytest.raises(OSError, match="No space left") as refusal:
        write_whole(tmp_path / "log", full)
    assert (refusal.value.errno, refusal.value.filename) == (ENOSPC, str(tmp_path / "log"))
    with pytest.raises(FileNotFoundError) as unread:
        write_whole(tmp_path / "log", missing)
    assert unread.value.filename == "nowhere/input"
    assert list(tmp_path.iterdir()) == []


def test_a_place_is_checked_before_anything_is_written_there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    check_place(tmp_path / "new" / "deep" / "file")
    (tmp_path / "file").write_text("before")
    check_place(tmp_path / "file")
    os.mkfifo(tmp_path / "pipe")
    for place, kind in (
        (tmp_path, IsADirectoryError),
        (tmp_path / "file" / "log", NotADirectoryError),
        (tmp_path / "pipe", FileExistsError),
    ):
        with pytest.raises(kind, match=place.name):
            check_place(place)
    monkeypatch.setattr(os, "access", lambda *_: False)  # a test may run as root
    with pytest.raises(PermissionError, match="log"):
        check_place(tmp_path / "log")
    assert {path.name for path in tmp_path.iterdir()} == {"file", "pipe"}
