import hashlib
import os
from datetime import timedelta
from pathlib import Path
from types import SimpleNamespace

import pytest

from db.blobs import BlobStore, open_blobs
from db.errors import NotFound, StorageUnavailable

CONTENT = b"tactile"
SHA256 = hashlib.sha256(CONTENT).hexdigest()


@pytest.fixture(params=["folder", "s3"])
def blobs(tmp_path: Path, request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> BlobStore:
    if request.param == "folder":
        return BlobStore(tmp_path)
    request.getfixturevalue("s3")
    monkeypatch.setattr("db.blobs.ORPHAN_AGE", timedelta(0))
    return open_blobs(tmp_path, "s3://grasps/lab", 2**30)


def files(folder: Path) -> list[str]:
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file())


def test_a_blob_is_named_for_its_content(blobs: BlobStore, tmp_path: Path) -> None:
    with blobs.spool() as spool:
        spool.write(CONTENT[:3])
        spool.write(CONTENT[3:])
        assert spool.size == len(CONTENT)
        assert spool.keep() == SHA256
    assert blobs.path(SHA256).read_bytes() == CONTENT
    assert files(tmp_path) == [f"blobs/{SHA256[:2]}/{SHA256}"]


def test_the_same_content_is_one_blob(blobs: BlobStore, tmp_path: Path) -> None:
    assert {blobs.put(CONTENT), blobs.put(CONTENT)} == {SHA256}
    assert len(files(tmp_path)) == 1


def test_nothing_stays_of_what_was_not_kept(blobs: BlobStore, tmp_path: Path) -> None:
    def upload() -> None:
        with blobs.spool() as spool:
            spool.write(CONTENT)
            raise KeyError("the client went away")

    with pytest.raises(KeyError):
        upload()
    assert files(tmp_path) == []


def test_what_was_written_can_be_read_before_it_is_kept(blobs: BlobStore) -> None:
    with blobs.spool() as spool:
        spool.write(CONTENT)
        spool.flush()
        assert spool.path.read_bytes() == CONTENT


def test_the_bytes_reach_the_disk_before_the_name_and_the_name_before_the_answer(
    blobs: BlobStore, monkeypatch: pytest.MonkeyPatch
) -> None:
    order: list[str] = []
    fsync, replace = os.fsync, Path.replace

    def noted_fsync(handle: int) -> None:
        order.append("folder" if Path(f"/proc/self/fd/{handle}").resolve().is_dir() else "file")
        fsync(handle)

    def noted_replace(path: Path, target: Path) -> Path:
        order.append("rename")
        return replace(path, target)

    monkeypatch.setattr(os, "fsync", noted_fsync)
    monkeypatch.setattr(Path, "replace", noted_replace)
    blobs.put(CONTENT)
    blobs.put(CONTENT)
    assert order == ["file", "folder", "rename", "folder", "file", "rename", "folder"]


@pytest.mark.parametrize("name", [SHA256, "../../etc/passwd", "", SHA256.upper(), SHA256 + "0"])
def test_an_unknown_blob_is_named(blobs: BlobStore, name: str) -> None:
    with pytest.raises(NotFound, match="no blob"):
        blobs.path(name)


def test_a_sweep_removes_what_nothing_refers_to(blobs: BlobStore, tmp_path: Path) -> None:
    kept, orphan = blobs.put(b"kept"), blobs.put(b"orphan")
    (tmp_path / "spool" / "left").write_bytes(b"half an upload")
    foreign = tmp_path / "blobs" / kept[:2] / "README"
    foreign.write_text("not ours")
    assert blobs.sweep(lambda hashes: set(hashes) & {kept}) == [orphan]
    assert list(blobs.hashes()) == [kept]
    assert foreign.exists()
    assert not list((tmp_path / "spool").iterdir())


def test_a_sweep_asks_for_all_hashes_in_portions(blobs: BlobStore, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("db.blobs.HASHES_PER_QUERY", 3)
    stored = {blobs.put(bytes([number])) for number in range(8)}
    asked: list[list[str]] = []

    def referenced(hashes: list[str]) -> set[str]:
        asked.append(hashes)
        return set(hashes)

    assert blobs.sweep(referenced) == []
    assert [len(some) for some in asked] == [3, 3, 2]
    assert {sha256 for some in asked for sha256 in some} == stored


@pytest.mark.parametrize("moment", ["write", "keep"])
def test_a_full_disk_is_named_and_leaves_nothing(
    blobs: BlobStore, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, moment: str
) -> None:
    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    def upload() -> None:
        with blobs.spool() as spool:
            if moment == "write":
                spool._file.close()
                spool._file = SimpleNamespace(write=full, close=lambda: None)  # type: ignore[assignment]
            else:
                monkeypatch.setattr(os, "fsync", full)
            spool.write(CONTENT)
            spool.keep()

    with pytest.raises(StorageUnavailable, match="No space left"):
        upload()
    assert files(tmp_path) == []


def test_a_folder_that_takes_no_files_is_named(blobs: BlobStore, tmp_path: Path) -> None:
    assert blobs.ping() is None
    (tmp_path / "spool").rmdir()
    with pytest.raises(StorageUnavailable, match="blob folder"):
        blobs.ping()


def test_a_disk_that_is_full_at_the_last_bytes_leaves_nothing(
    blobs: BlobStore, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    class FullDisk:
        """A file whose buffer finds no room on the disk, neither when it is flushed nor when it is closed."""

        def __init__(self, path: Path) -> None:
            path.touch()

        def write(self, chunk: bytes) -> int:
            return len(chunk)

        def flush(self) -> None:
            raise OSError(28, "No space left on device")

        close = flush

    def upload() -> None:
        with blobs.spool() as spool:
            spool.write(CONTENT)
            spool.flush()

    monkeypatch.setattr(Path, "open", lambda path, _mode: FullDisk(path))
    with pytest.raises(StorageUnavailable, match="No space left"):
        upload()
    assert files(tmp_path) == []
