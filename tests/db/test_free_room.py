"""Room on the disks of database and files."""

import shutil
from pathlib import Path
from unittest.mock import Mock

import pytest

from db import free_room
from db.blobs import BlobStore
from db.database import Database
from db.errors import StorageUnavailable


@pytest.fixture
def free(monkeypatch: pytest.MonkeyPatch) -> dict[str, int]:
    """Bytes free in folders by their names."""
    free = {"spool": 1000, "elsewhere": 1000, "total": 2000}
    monkeypatch.setattr(shutil, "disk_usage", lambda folder: (free["total"], 0, free[Path(folder).name]))
    return free


def test_too_little_room_is_said_of_the_store_whose_disk_has_it(tmp_path: Path, free: dict[str, int]) -> None:
    blobs = BlobStore(tmp_path)
    database = Database(f"sqlite:///{tmp_path / 'elsewhere' / 'stiction.sqlite3'}")
    free_room.require(database, blobs, 1000)
    free["spool"] = 999
    with pytest.raises(StorageUnavailable, match=r"^blob folder .*nearly full, 999 bytes are free; allowed: 1000$"):
        free_room.require(database, blobs, 1000)
    free |= {"spool": 1000, "elsewhere": 10}
    with pytest.raises(StorageUnavailable, match=r"^database sqlite.*nearly full, 10 bytes are free; allowed: 1000$"):
        free_room.require(database, blobs, 1000)
    free_room.require(database, blobs, 0)


def test_a_file_system_that_says_nothing_of_its_size_takes_uploads(tmp_path: Path, free: dict[str, int]) -> None:
    blobs, database = BlobStore(tmp_path), Mock(spec=Database, disk=None)
    free["spool"] = 0
    with pytest.raises(StorageUnavailable, match="nearly full"):
        free_room.require(database, blobs, 1000)
    free["total"] = 0
    free_room.require(database, blobs, 1000)


def test_the_room_is_what_the_file_system_says(tmp_path: Path) -> None:
    """Of another database than SQLite it is not known."""
    blobs, database = BlobStore(tmp_path), Mock(spec=Database, disk=None)
    free_room.require(database, blobs, shutil.disk_usage(tmp_path).free // 2)
    with pytest.raises(StorageUnavailable, match=r"^blob folder .*nearly full"):
        free_room.require(database, blobs, 2**60)
