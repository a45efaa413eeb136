"""Blobs that are set aside."""

import os
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

from db.quarantine import FolderQuarantine
from db.text import is_storable

ONE, OTHER = "a" * 64, "b" * 64


@pytest.fixture
def blobs(tmp_path: Path) -> Path:
    for name in (ONE, OTHER):
        (tmp_path / name[:2]).mkdir()
        (tmp_path / name[:2] / name).write_text(name)
        os.utime(tmp_path / name[:2] / name, (0.0, 0.0))
    return tmp_path


@pytest.fixture
def aside(blobs: Path) -> FolderQuarantine:
    return FolderQuarantine(blobs / "quarantine", lambda sha256: blobs / sha256[:2] / sha256)


def test_what_is_set_aside_comes_back_with_its_bytes(aside: FolderQuarantine, blobs: Path) -> None:
    aside.put(ONE)
    assert not (blobs / "aa" / ONE).exists()
    assert list(aside.hashes()) == [ONE]
    (blobs / "aa").rmdir()
    assert aside.recall(ONE)
    assert (blobs / "aa" / ONE).read_text() == ONE
    assert not aside.recall(ONE)
    assert list(aside.hashes()) == []


def test_what_is_not_there_cannot_be_set_aside_and_that_is_no_error(aside: FolderQuarantine) -> None:
    aside.put("c" * 64)
    assert list(aside.hashes()) == []
    aside.delete(["c" * 64])


def test_it_is_there_since_it_was_set_aside_however_old_it_is(aside: FolderQuarantine, blobs: Path) -> None:
    aside.put(ONE)
    aside.put(OTHER)
    moment = datetime(2026, 1, 1, tzinfo=UTC)
    os.utime(blobs / "quarantine" / ONE, (moment.timestamp(),) * 2)
    assert list(aside.hashes(moment + timedelta(seconds=1))) == [ONE]
    assert list(aside.hashes(moment)) == []
    assert list(aside.hashes(datetime.now(UTC) - timedelta(hours=1))) == [ONE]


def test_only_what_is_named_is_deleted_and_other_files_are_no_blobs(aside: FolderQuarantine, blobs: Path) -> None:
    aside.put(ONE)
    aside.put(OTHER)
    (blobs / "quarantine" / "note.txt").touch()
    aside.delete([OTHER])
    assert list(aside.hashes()) == [ONE]
    assert (blobs / "quarantine" / "note.txt").exists()


@pytest.mark.parametrize(
    ("text", "storable"),
    [("", True), ("µ\U0001f600\ud7ff\ue000", True), ("a\0", False), (chr(0xD800), False), (chr(0xDFFF), False)],
)
def test_text_without_nul_and_lone_surrogates_is_storable(text: str, storable: bool) -> None:
    assert is_storable(text) is storable


@pytest.mark.parametrize("way", ["put", "recall"])
def test_the_name_of_what_was_moved_reaches_the_disk_where_it_is_now(
    aside: FolderQuarantine, monkeypatch: pytest.MonkeyPatch, way: str
) -> None:
    if way == "recall":
        aside.put(ONE)
    synced: list[tuple[str, bool]] = []
    fsync = os.fsync

    def noted(handle: int) -> None:
        folder = Path(os.readlink(f"/proc/self/fd/{handle}"))
        synced.append((folder.name, (folder / ONE).exists()))
        fsync(handle)

    monkeypatch.setattr(os, "fsync", noted)
    getattr(aside, way)(ONE)
    assert synced[-1] == (("quarantine" if way == "put" else "aa"), True)
