import hashlib
import os
import subprocess
import sys
from datetime import UTC, datetime
from pathlib import Path
from types import SimpleNamespace

import pytest

from db import blobs as module
from db.blobs import BlobStore, open_blobs
from db.errors import BlobDamaged, NotFound, StorageUnavailable

CONTENT = b"tactile"
SHA256 = hashlib.sha256(CONTENT).hexdigest()


@pytest.fixture(params=["folder", "s3"])
def blobs(tmp_path: Path, request: pytest.FixtureRequest) -> BlobStore:
    if request.param == "folder":
        return BlobStore(tmp_path)
    request.getfixturevalue("s3")
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


def test_only_blobs_count_and_what_was_under_way_can_be_cleared(blobs: BlobStore, tmp_path: Path) -> None:
    kept = blobs.put(b"kept")
    (tmp_path / "spool" / "left").write_bytes(b"half an upload")
    (tmp_path / "spool" / ".stiction-left.part").mkdir()
    (tmp_path / "spool" / ".stiction-left.part" / "report").write_text("half a report")
    foreign = tmp_path / "blobs" / kept[:2] / "README"
    foreign.write_text("not ours")
    blobs.write_store_id("0" * 32)
    blobs.clear_spool()
    assert list(blobs.hashes()) == [kept]
    assert blobs.read_store_id() == "0" * 32
    assert foreign.exists()
    assert not list((tmp_path / "spool").iterdir())


def test_a_blob_set_aside_is_no_blob_until_somebody_reads_it(blobs: BlobStore) -> None:
    sha256 = blobs.put(CONTENT)
    blobs.quarantine.put(sha256)
    assert (list(blobs.hashes()), list(blobs.quarantine.hashes())) == ([], [sha256])
    assert not blobs.has(sha256)
    blobs.remove([sha256])  # from the cache of an object store
    assert blobs.path(sha256).read_bytes() == CONTENT
    assert (list(blobs.hashes()), list(blobs.quarantine.hashes())) == ([sha256], [])
    blobs.quarantine.put(sha256)
    blobs.quarantine.delete([sha256])
    blobs.remove([sha256])
    with pytest.raises(NotFound):
        blobs.path(sha256)
    assert not blobs.quarantine.recall(sha256)


def test_a_flipped_bit_is_named_at_the_next_reading(tmp_path: Path) -> None:
    blobs = BlobStore(tmp_path)
    sha256 = blobs.put(CONTENT)
    path = blobs.path(sha256)
    path.write_bytes(bytes([CONTENT[0] ^ 1]) + CONTENT[1:])
    with pytest.raises(BlobDamaged, match=f"{sha256} has other bytes than it had: their hash is "):
        blobs.path(sha256)
    assert blobs.put(CONTENT) == sha256  # sent again, it is mended
    assert blobs.path(sha256).read_bytes() == CONTENT


def test_what_was_read_a_moment_ago_is_not_read_again_where_that_will_do(
    blobs: BlobStore, monkeypatch: pytest.MonkeyPatch
) -> None:
    read: list[Path] = []
    hashed = module._hash
    monkeypatch.setattr(module, "_hash", lambda path: read.append(path) or hashed(path))  # type: ignore[func-returns-value]
    blobs.put(CONTENT)
    for within, times in ((60.0, 1), (60.0, 1), (0.0, 2), (60.0, 2), (1e-9, 3)):
        assert blobs.path(SHA256, within).read_bytes() == CONTENT
        assert len(read) == times


def test_a_file_that_somebody_wrote_to_since_is_read_again(tmp_path: Path) -> None:
    blobs = BlobStore(tmp_path)
    path = blobs.path(blobs.put(CONTENT))
    path.write_bytes(CONTENT[::-1])
    os.utime(path, ns=(0, 0))  # within one tick of the clock
    with pytest.raises(BlobDamaged):
        blobs.path(SHA256, 60.0)
    path.unlink()
    with pytest.raises(NotFound):
        blobs.path(SHA256, 60.0)


def test_a_folder_that_is_not_there_any_more_is_no_missing_blob(tmp_path: Path) -> None:
    """Its disk is not mounted: whoever reads or writes is to come again."""
    blobs = BlobStore(tmp_path)
    sha256 = blobs.put(CONTENT)
    blobs.write_store_id("0" * 32)
    blobs.store_id = "0" * 32
    (tmp_path / "blobs").rename(tmp_path / "away")
    for left in ("nothing", "an empty folder"):
        if left != "nothing":
            (tmp_path / "blobs").mkdir()
        for use in (lambda: blobs.path(sha256), lambda: blobs.put(CONTENT), lambda: blobs.remove([]), blobs.ping):
            with pytest.raises(StorageUnavailable, match="blob folder"):
                use()


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

        close = fileno = flush

    def upload() -> None:
        with blobs.spool() as spool:
            spool.write(CONTENT)
            spool.flush()

    monkeypatch.setattr(Path, "open", lambda path, _mode: FullDisk(path))
    with pytest.raises(StorageUnavailable, match="No space left"):
        upload()
    assert files(tmp_path) == []


def test_a_store_makes_its_folder_and_finds_it_again(tmp_path: Path) -> None:
    folder = tmp_path / "of the lab" / "blobs of today"
    BlobStore(folder)
    made = {path for path in tmp_path.rglob("*") if path.is_dir()}
    assert folder in made
    BlobStore(folder)
    assert {path for path in tmp_path.rglob("*") if path.is_dir()} == made


def hash_of(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()


def test_what_another_wrote_is_taken_as_it_is(tmp_path: Path) -> None:
    store = BlobStore(tmp_path / "store")
    with store.spool() as spool:
        spool.path.write_bytes(b"but this one")
        spool.adopt()
        assert (spool.size, spool.keep()) == (12, hash_of(b"but this one"))
    assert store.path(hash_of(b"but this one")).read_bytes() == b"but this one"


def test_a_copy_of_a_file_has_the_hash_that_it_must_have(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("db.blobs.COPY_BYTES", 3)
    store, file = BlobStore(tmp_path / "store"), tmp_path / "file"
    file.write_bytes(b"12345678")
    store.take(file, hash_of(b"12345678"))
    assert store.path(hash_of(b"12345678")).read_bytes() == file.read_bytes() == b"12345678"
    with pytest.raises(BlobDamaged) as damaged:
        store.take(file, hash_of(b"1234"))
    assert (damaged.value.sha256, damaged.value.found) == (hash_of(b"1234"), hash_of(b"12345678"))
    assert not store.has(hash_of(b"1234"))
    assert list(store.disk.iterdir()) == []


def test_blobs_stored_before_a_moment_are_told(tmp_path: Path) -> None:
    store = BlobStore(tmp_path / "store")
    hashes = [store.put(bytes([number])) for number in range(3)]
    for sha256, seconds in zip(hashes, (100, 200, 300), strict=True):
        os.utime(store.locate(sha256), (seconds, seconds))
    for moment, count in ((100, 0), (101, 1), (200, 1), (300.5, 3)):
        assert set(store.hashes(datetime.fromtimestamp(moment, UTC))) == set(hashes[:count])
    assert set(store.hashes()) == set(hashes)
    assert list(store.hashes_under(hashes[0][:2])) == hashes[:1]


def test_only_those_that_are_named_are_removed(tmp_path: Path) -> None:
    store = BlobStore(tmp_path / "store")
    hashes = [store.put(bytes([number])) for number in range(3)]
    store.remove(iter([hashes[1], "f" * 64]))
    assert [store.has(sha256) for sha256 in hashes] == [True, False, True]


@pytest.mark.parametrize("within", ["blobs", "spool", "quarantine", "blobs/ab"])
def test_a_folder_among_the_store_s_own_is_known_by_any_name(tmp_path: Path, within: str) -> None:
    store = BlobStore(tmp_path / "store")
    (tmp_path / "link").symlink_to(tmp_path / "store")
    for folder in (tmp_path / "store" / within, tmp_path / "link" / within):
        assert store.has_within(folder)
    assert not store.has_within(tmp_path / "other")
    assert not store.has_within(tmp_path / "storeroom" / within)


def test_a_folder_whose_blobs_are_the_store_s_or_have_them_is_not_another(tmp_path: Path) -> None:
    store = BlobStore(tmp_path / "blobs" / "store")
    assert store.has_within(tmp_path / "blobs" / "store")
    assert store.has_within(tmp_path)  # whose own blobs have the store among them
    for folder, is_within in ((tmp_path, True), (tmp_path / "blobs", True), (tmp_path / "other", False)):
        assert store.is_within(folder) is is_within


@pytest.mark.parametrize("settled", [True, False])
def test_a_store_is_settled_once_its_database_says_so_too(tmp_path: Path, settled: bool) -> None:
    store = BlobStore(tmp_path / "store")
    assert (store.read_store_id(), store.is_settled, store.cached_store_id()) == (None, False, None)
    store.write_store_id("1" * 32, settled=settled)
    assert (store.read_store_id(), store.is_settled, store.cached_store_id()) == ("1" * 32, settled, None)
    assert (tmp_path / "store" / "blobs" / "store-id").read_text().endswith(f"{'1' * 32}\n")
    assert list(store.disk.iterdir()) == []


def test_the_files_of_another_store_in_its_place_are_not_taken(tmp_path: Path) -> None:
    store = BlobStore(tmp_path / "store")
    store.write_store_id("2" * 32)
    store.store_id = "1" * 32
    told = f"its store id was {'1' * 32} and is {'2' * 32}; is its disk there"
    for act in (store.ping, lambda: store.remove([]), lambda: store.put(b"a"), lambda: store.locate("f" * 64)):
        with pytest.raises(StorageUnavailable, match=told):
            act()
    store.store_id = "2" * 32
    store.ping()


def test_a_file_under_way_is_removed_once_the_process_that_holds_it_is_gone_and_no_earlier(tmp_path: Path) -> None:
    blobs = BlobStore(tmp_path)
    hold = "import sys, time; from pathlib import Path; from db.blobs import BlobStore; "
    hold += "spool = BlobStore(Path(sys.argv[1])).spool(); print(spool.path, flush=True); time.sleep(60)"
    with subprocess.Popen([sys.executable, "-c", hold, str(tmp_path)], stdout=subprocess.PIPE, text=True) as holder:
        assert holder.stdout is not None
        path = Path(holder.stdout.readline().strip())
        with blobs.spool() as own:
            assert blobs.under_way() in ([path, own.path], [own.path, path])
            assert not blobs.remove_unheld(own.path)
            assert not blobs.remove_unheld(path)
            blobs.clear_spool()  # as a server does that starts beside a restore
            own.write(CONTENT)
            assert own.keep() == SHA256
        holder.kill()
        holder.wait()
    assert blobs.under_way() == [path]
    assert blobs.remove_unheld(path)
    assert not blobs.remove_unheld(path)
    blobs.folder().joinpath("part").write_bytes(CONTENT)
    assert [blobs.remove_unheld(path) for path in blobs.under_way()] == [True]
    assert files(tmp_path) == [f"blobs/{SHA256[:2]}/{SHA256}"]
