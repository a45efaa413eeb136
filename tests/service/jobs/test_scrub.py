"""Stored files that are read through, in a folder of their own."""

from pathlib import Path
from typing import Any

import pytest

from db.blobs import BlobStore
from db.database import Database
from db.errors import StorageUnavailable
from db.paging import Window
from db.records import AuditFilter
from db.repositories import audit
from service.jobs.scrub import Scrub

ONLY_SQLITE = pytest.mark.parametrize("engine_name", ["sqlite"], indirect=True)
CONTENTS = [bytes([number]) * (number + 1) for number in range(6)]


@pytest.fixture
def folder(tmp_path: Path) -> BlobStore:
    blobs = BlobStore(tmp_path / "store")
    for content in CONTENTS:
        blobs.put(content)
    return blobs


def scrub(database: Any, blobs: BlobStore, pace: float = 1e12, *, leads: bool = True) -> Scrub:
    return Scrub(database, blobs, pace, lambda: leads)


def test_a_pass_reads_every_file_once_and_counts_its_bytes(folder: BlobStore) -> None:
    reader = scrub(None, folder)
    for passes in (1, 2):
        reader.read_all()
        assert (reader.bytes, reader.passes) == (passes * sum(map(len, CONTENTS)), passes)


def test_files_are_read_at_the_pace_that_is_set(folder: BlobStore, monkeypatch: pytest.MonkeyPatch) -> None:
    reader, rests = scrub(None, folder, pace=4.0), list[float]()
    monkeypatch.setattr(reader._thread, "sleep", lambda seconds: bool(rests.append(seconds)))
    reader.read_all()
    assert sorted(rests) == [size / 4.0 for size in range(1, 7)]


def test_a_pass_that_is_told_to_stop_is_none(folder: BlobStore, monkeypatch: pytest.MonkeyPatch) -> None:
    reader, rests = scrub(None, folder), list[float]()

    def stop(seconds: float) -> bool:
        rests.append(seconds)
        return len(rests) == 2

    monkeypatch.setattr(reader._thread, "sleep", stop)
    reader.read_all()
    assert (len(rests), reader.passes) == (2, 0)


@pytest.mark.parametrize("first", [0, 1, 255])
def test_a_pass_begins_anywhere_and_goes_all_around(
    folder: BlobStore, monkeypatch: pytest.MonkeyPatch, first: int
) -> None:
    monkeypatch.setattr("service.jobs.scrub.random.randrange", lambda count: first if count == 256 else -1)
    prefixes = list[str]()
    monkeypatch.setattr(folder, "hashes_under", lambda prefix: iter(prefixes.append(prefix) or ()))  # type: ignore[func-returns-value]
    scrub(None, folder).read_all()
    assert prefixes == [f"{(first + number) % 256:02x}" for number in range(256)]


def test_who_does_not_lead_reads_nothing(folder: BlobStore) -> None:
    reader = scrub(None, folder, leads=False)
    reader._look()
    assert (reader.bytes, reader.passes) == (0, 0)


@pytest.mark.parametrize(("error", "level"), [(StorageUnavailable("gone"), "WARNING"), (RuntimeError("ours"), "ERROR")])
def test_a_pass_that_fails_is_logged_and_not_counted(
    folder: BlobStore, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture, error: Exception, level: str
) -> None:
    def fail(*_: object) -> None:
        raise error

    monkeypatch.setattr(folder, "path", fail)
    reader = scrub(None, folder)
    reader._look()
    assert (reader.passes, [record.levelname for record in caplog.records]) == (0, [level])
    assert "files are not read through" in caplog.text


def test_a_file_that_is_deleted_meanwhile_has_no_bytes(folder: BlobStore, monkeypatch: pytest.MonkeyPatch) -> None:
    gone = "f" * 64
    monkeypatch.setattr(folder, "hashes_under", lambda prefix: iter([gone] if prefix == "ff" else ()))
    reader = scrub(None, folder)
    reader.read_all()
    assert (reader.bytes, reader.passes) == (0, 1)


@ONLY_SQLITE
def test_damage_is_recorded_and_the_others_are_read(database: Database, folder: BlobStore) -> None:
    damaged = next(iter(folder.hashes()))
    with folder.locate(damaged).open("ab") as stream:
        stream.write(b"more")
    reader = scrub(database, folder)
    reader.read_all()
    assert (reader.bytes, reader.passes) == (sum(map(len, CONTENTS)) + 4, 1)
    with database.read() as session:
        (entry,) = audit.list_all(session, Window("id"), AuditFilter(action="blob.damaged"))
    assert (entry.subject, entry.details["by"]) == (damaged, "scrub")


@pytest.mark.parametrize("pace", [0.0, 1.0])
def test_without_a_pace_nothing_begins(folder: BlobStore, monkeypatch: pytest.MonkeyPatch, pace: float) -> None:
    reader, begun = scrub(None, folder, pace), list[bool]()
    monkeypatch.setattr(reader._thread, "start", lambda: begun.append(True))
    reader.start()
    assert begun == [True] * (pace > 0.0)
