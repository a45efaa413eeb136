import hashlib
import os
import sys
import time
from datetime import timedelta
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import obstore
import pytest

from db.blobs import open_blobs
from db.errors import BlobDamaged, DriverMissing, StorageUnavailable
from db.object_store import SCHEMES, ObjectStore

URL = "s3://grasps/lab"
MIB = 2**20


def test_another_machine_reads_what_one_has_stored(s3: Any, tmp_path: Path) -> None:
    """Large blobs go up in parts."""
    content = os.urandom(12 * MIB)
    sha256 = open_blobs(tmp_path / "one", URL, MIB).put(content)
    assert list(s3.objects) == [f"lab/{sha256[:2]}/{sha256}"]
    other = open_blobs(tmp_path / "other", URL, MIB)
    assert other.path(sha256).read_bytes() == content
    assert sha256 == hashlib.sha256(content).hexdigest()
    s3.is_down = True
    assert other.path(sha256).read_bytes() == content  # from its cache


def test_a_blob_is_not_there_before_the_store_has_it(s3: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("db.object_store.OBJECT_STORE_TIMEOUT", 0.5)
    blobs = open_blobs(tmp_path, URL, MIB)
    s3.is_down = True
    with pytest.raises(StorageUnavailable, match="blob store"):
        blobs.put(b"tactile")
    with pytest.raises(StorageUnavailable, match="blob store"):
        blobs.ping()
    assert not [path for path in tmp_path.rglob("*") if path.is_file()]
    s3.is_down = False
    blobs.ping()
    assert s3.objects == {}


@pytest.mark.usefixtures("s3")
def test_a_removed_blob_is_gone_from_its_place_alone(tmp_path: Path) -> None:
    blobs = open_blobs(tmp_path, URL, MIB)
    kept, aside, gone = (blobs.put(content) for content in (b"kept", b"aside", b"gone"))
    blobs.quarantine.put(aside)
    blobs.remove([gone, aside])
    assert [blobs.has(each) for each in (kept, aside, gone)] == [True, False, False]
    assert list(blobs.quarantine.hashes()) == [aside]


@pytest.mark.usefixtures("s3")
def test_what_another_has_just_set_aside_is_no_error(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    first, other = (open_blobs(tmp_path / name, URL, MIB) for name in ("one", "other"))
    sha256, rename = first.put(b"tactile"), obstore.rename

    def rename_too_late(*given: Any) -> None:
        monkeypatch.setattr(obstore, "rename", rename)
        other.quarantine.put(sha256)
        rename(*given)

    monkeypatch.setattr(obstore, "rename", rename_too_late)
    first.quarantine.put(sha256)
    assert (first.has(sha256), list(first.quarantine.hashes())) == (False, [sha256])


def test_what_comes_back_changed_is_not_taken(s3: Any, tmp_path: Path) -> None:
    sha256 = open_blobs(tmp_path / "one", URL, MIB).put(b"tactile")
    s3.objects[f"lab/{sha256[:2]}/{sha256}"] = b"tactilE"
    other = open_blobs(tmp_path / "other", URL, MIB)
    with pytest.raises(BlobDamaged, match="other bytes than it had"):
        other.path(sha256)
    assert not [path for path in (tmp_path / "other").rglob("*") if path.is_file()]


def test_the_cache_drops_what_was_not_used_for_longest(
    s3: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("db.blobs.CACHE_GRACE", 0.0)
    blobs = open_blobs(tmp_path, URL, 250_000)
    stored = []
    for number in range(4):
        stored.append(blobs.put(bytes([number]) * 100_000))
        time.sleep(0.01)
        blobs.path(stored[0])
        time.sleep(0.01)
    kept = {path.name for path in (tmp_path / "blobs").rglob("*") if path.is_file()}
    assert kept == {stored[0], stored[3]}
    assert len(s3.objects) == 4
    assert blobs.path(stored[1]).stat().st_size == 100_000


def test_what_was_just_used_stays_in_the_cache_where_the_clock_was_set_ahead(
    s3: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert s3.objects == {}
    monkeypatch.setattr("db.blobs.time", SimpleNamespace(time=lambda: time.time() + 86400.0))
    blobs = open_blobs(tmp_path, URL, 250_000)
    stored = [blobs.put(bytes([number]) * 100_000) for number in range(4)]
    assert sorted(path.name for path in (tmp_path / "blobs").glob("??/*")) == sorted(stored)


def test_ages_are_those_of_the_stores_clock(s3: Any, tmp_path: Path) -> None:
    """Two days passed there since anything was stored."""
    blobs = open_blobs(tmp_path, URL, MIB)
    sha256 = blobs.put(b"tactile")
    assert list(blobs.hashes(blobs.now() - timedelta(days=3))) == []
    assert list(blobs.hashes(blobs.now() - timedelta(hours=24))) == [sha256]
    blobs.quarantine.put(sha256)
    assert list(s3.objects) == [f"lab/quarantine/{sha256}"]
    assert list(blobs.quarantine.hashes(blobs.now() - timedelta(days=3))) == []
    assert list(blobs.quarantine.hashes(blobs.now() - timedelta(hours=24))) == [sha256]


def test_two_may_look_at_the_stores_clock_at_once(s3: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """They wrote to one object, and who was first deleted it under the other."""
    blobs, head = open_blobs(tmp_path, URL, MIB), obstore.head

    def look_beside(*arguments: Any) -> Any:
        monkeypatch.setattr(obstore, "head", head)
        assert blobs.now() == told[0]
        return head(*arguments)

    told = [blobs.now()]
    monkeypatch.setattr(obstore, "head", look_beside)
    assert blobs.now() == told[0]
    assert s3.objects == {}


def test_a_damaged_copy_in_the_cache_is_fetched_again(s3: Any, tmp_path: Path) -> None:
    assert s3.objects == {}
    blobs = open_blobs(tmp_path, URL, MIB)
    sha256 = blobs.put(b"tactile")
    blobs.path(sha256).write_bytes(b"tactilE")
    assert blobs.path(sha256).read_bytes() == b"tactile"


def test_a_missing_library_is_named_with_its_extra(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "obstore", None)
    with pytest.raises(DriverMissing, match=r"blob store is s3://grasps/lab, .* \(stiction\[s3\] brings one\)"):
        open_blobs(tmp_path, URL)


def test_a_url_that_no_store_has_is_refused(tmp_path: Path) -> None:
    with pytest.raises(StorageUnavailable, match="blob store"):
        open_blobs(tmp_path, "gopher://grasps")


@pytest.mark.parametrize(("url", "inner"), [("s3://grasps", "lab/"), ("s3://grasps/lab", "old/"), ("s3://grasps", "")])
def test_a_store_sees_its_own_blobs_and_not_those_of_one_in_a_folder_of_it(
    s3: Any, tmp_path: Path, url: str, inner: str
) -> None:
    """A sweep at a bucket's root took them for blobs to which nothing refers."""
    blobs = open_blobs(tmp_path / "own", url, MIB)
    own, aside = (blobs.put(content) for content in (b"own", b"aside"))
    blobs.quarantine.put(aside)
    other = open_blobs(tmp_path / "other", f"{url}/{inner or 'ab/'}", MIB)
    for content in (b"theirs", b"theirs aside"):
        theirs = other.put(content)
    other.quarantine.put(theirs)
    assert list(blobs.hashes()) == [own]
    assert list(blobs.quarantine.hashes()) == [aside]
    kept = set(s3.objects)
    blobs.quarantine.delete([theirs])
    blobs.remove([theirs])
    assert set(s3.objects) == kept


@pytest.mark.parametrize("scheme", SCHEMES)
def test_the_library_knows_the_schemes_that_a_setting_may_have(
    scheme: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("AZURE_STORAGE_ACCOUNT_NAME", "lab")
    place = tmp_path if scheme == "file" else "grasps"
    assert str(ObjectStore(f"{scheme}://{place}")) == f"{scheme}://{place}"


def test_a_scheme_that_the_library_does_not_know_is_told_with_the_address() -> None:
    with pytest.raises(StorageUnavailable, match=r'^blob store foo://x: .*Unable to recognise URL "foo://x"'):
        ObjectStore("foo://x")
