"""A stored log as a file: as it is kept, or written anew, and what is closed at the end."""

import asyncio
import hashlib
import os
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from db.errors import StorageUnavailable
from service import formats
from service.domain.errors import FileDeleted, UnsupportedFormat
from service.domain.logs.export import LogFile, export


class Stores:
    """A log's file, and whoever reads it and makes others of it."""

    def __init__(self, path: Path, error: Exception | None = None) -> None:
        self.path, self.error, self.said = path, error, list[Any]()
        self.is_full = False
        self.blobs = self.readers = self.threads = self

    async def files(self, owner: str, hashes: list[str], checked_within: float) -> list[Path]:
        self.said.append(("files", owner, hashes, checked_within))
        return [self.path]

    async def run(self, _owner: str, do: Any, *given: Any) -> Any:
        return do(*given)

    def require_room(self) -> None:
        if self.is_full:
            raise StorageUnavailable("its disk is nearly full")

    async def write(self, source: Path, target: Path, name: str, owner: str) -> None:
        self.said.append(("write", source, name, owner))
        if self.error is not None:
            raise self.error
        target.write_text("made")

    @contextmanager
    def spool(self) -> Any:
        path = self.path.with_name("spool")
        path.touch()
        try:
            made = SimpleNamespace(path=path, sha256="")
            made.adopt = lambda: setattr(made, "sha256", hashlib.sha256(path.read_bytes()).hexdigest())
            yield made
        finally:
            path.unlink()


def exported(stores: Stores, name: str, has_file: bool = True, checked_within: float = 0.0) -> LogFile:
    log: Any = SimpleNamespace(id="7f", sha256="0", has_file=has_file)

    async def room() -> None:
        stores.said.append("room")

    return asyncio.run(export(stores, log, name, "key", room, checked_within))  # type: ignore[arg-type]


@pytest.fixture
def stores(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Stores:
    (tmp_path / "log").write_text("kept")
    monkeypatch.setattr(formats, "identify", lambda _: "npz")
    return Stores(tmp_path / "log")


def test_a_file_of_its_own_format_is_sent_as_it_is_also_once_it_is_deleted(stores: Stores) -> None:
    found = exported(stores, "npz", checked_within=60.0)
    assert found.sha256 == "0"
    assert stores.said == [("files", "key", ["0"], 60.0)]
    stores.path.unlink()
    assert found.path.read_text() == "kept"
    number = int(found.path.name)
    found.close.close()
    with pytest.raises(OSError, match="Bad file descriptor"):
        os.fstat(number)


def test_nothing_is_made_on_a_disk_that_is_nearly_full(stores: Stores) -> None:
    """A key without any quota left could fill it by slow downloads, while no upload was taken any more."""
    stores.is_full = True
    with pytest.raises(StorageUnavailable):
        exported(stores, "mcap")
    assert stores.said[1:] == ["room"]
    exported(stores, "npz").close.close()


def test_another_format_is_made_after_there_is_room_and_goes_at_the_end(stores: Stores) -> None:
    found = exported(stores, "mcap")
    assert stores.said[1:] == ["room", ("write", stores.path, "mcap", "key")]
    assert (found.sha256, found.path.read_text()) == (hashlib.sha256(b"made").hexdigest(), "made")
    found.close.close()
    assert not found.path.exists()


def test_a_file_of_another_format_is_made_into_a_container(stores: Stores, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(formats, "identify", lambda _: "parquet")
    found = exported(stores, "npz")
    assert (found.sha256, found.path.read_text()) == (hashlib.sha256(b"made").hexdigest(), "made")
    found.close.close()


def test_what_cannot_be_made_leaves_nothing(stores: Stores) -> None:
    stores.error = formats.UnsupportedFormat("library of mcap", "mcap, which is not installed", "the extra")
    with pytest.raises(UnsupportedFormat, match="library of mcap is mcap, which is not installed; allowed: the extra"):
        exported(stores, "mcap")
    assert [path.name for path in stores.path.parent.iterdir()] == ["log"]


def test_a_file_that_is_deleted_is_told_as_such(stores: Stores) -> None:
    with pytest.raises(FileDeleted, match=r"^the file of grasp log 7f was deleted, as old uploads are here$"):
        exported(stores, "npz", has_file=False)
    assert stores.said == []
    stores.path.unlink()
    with pytest.raises(FileDeleted, match=r"^the file of grasp log 7f has just been deleted$"):
        exported(stores, "npz")
