import json
import os
import time
from collections.abc import Callable
from datetime import timedelta
from pathlib import Path
from typing import Any

import pytest

from db import identity
from db.blobs import BlobStore
from db.database import Database
from db.errors import StoreMismatch
from db.paging import Window
from db.records import AuditEntry, AuditFilter
from db.repositories import audit
from service.cli import main
from service.cli.stores import command_actor
from service.jobs import garbage
from service.jobs.retention import Retention
from tests.service.jobs.clocks import vouch_for_the_clock

NONE = timedelta(0)
ONLY_SQLITE = pytest.mark.parametrize("engine_name", ["sqlite"], indirect=True)
NPZ = {"content-type": "application/vnd.stiction.grasp-log+npz"}


@pytest.fixture
def orphan(reach: Callable[..., Any], database: Database, blobs: BlobStore, content: bytes) -> str:
    """A blob without a row, two days old, beside a log."""
    identity.join(database, blobs, alone=True)
    answer = reach("open").request("POST", "/v1/grasp-logs", content=content, headers=NPZ)
    answer.raise_for_status()
    sha256 = blobs.put(b"the server died before its row was written")
    grow_old(blobs.path(sha256), days=2.0)
    return sha256


def grow_old(path: Path, days: float) -> None:
    moment = time.time() - 86400.0 * days
    os.utime(path, (moment, moment))


def recorded(database: Database) -> list[AuditEntry]:
    with database.read() as session:
        return audit.list_all(session, Window("id"), AuditFilter(action="quarantine.deleted"))


def test_what_nothing_refers_to_is_set_aside_and_deleted_after_the_grace(
    orphan: str, database: Database, blobs: BlobStore, tmp_path: Path
) -> None:
    assert list(garbage.find_unreferenced(database, blobs)) == [orphan]
    assert (garbage.set_aside(database, blobs), garbage.set_aside(database, blobs)) == (1, 0)
    assert orphan not in set(blobs.hashes())
    assert len(list(blobs.hashes())) == 1
    grace = timedelta(days=7)
    assert garbage.delete_set_aside(database, blobs, grace) == 0
    grow_old(tmp_path / "quarantine" / orphan, days=8.0)
    assert recorded(database) == []
    assert garbage.delete_set_aside(database, blobs, grace) == 1
    assert list(blobs.quarantine.hashes()) == []
    (entry,) = recorded(database)
    assert (entry.actor.name, entry.subject) == ("service", blobs.store_id)
    assert entry.details == {"files": 1, "grace_seconds": 7 * 86400.0}


def test_what_is_young_stays_in_its_place(orphan: str, database: Database, blobs: BlobStore) -> None:
    """Somebody may be about to write its row."""
    young = blobs.put(b"an upload under way")
    assert garbage.set_aside(database, blobs) == 1
    assert blobs.has(young)
    assert not blobs.has(orphan)


def test_what_is_needed_after_all_comes_back_and_is_not_deleted(
    orphan: str, database: Database, blobs: BlobStore
) -> None:
    assert orphan
    (needed,) = set(blobs.hashes()) - {orphan}
    blobs.quarantine.put(needed)
    assert garbage.delete_set_aside(database, blobs, NONE) == 0
    assert blobs.has(needed)


def test_hashes_are_asked_for_in_portions(
    orphan: str, database: Database, blobs: BlobStore, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(garbage, "HASHES_PER_QUERY", 3)
    more = {blobs.put(bytes([number])) for number in range(7)}
    assert set(garbage.find_unreferenced(database, blobs, -timedelta(hours=1))) == {orphan, *more}


def test_a_database_without_logs_has_nothing_deleted(database: Database, blobs: BlobStore) -> None:
    identity.join(database, blobs, alone=True)
    assert garbage.set_aside(database, blobs, NONE) == 0
    blobs.put(b"tactile")
    for step in (garbage.set_aside, garbage.delete_set_aside):
        with pytest.raises(StoreMismatch, match="refers to no file, and blob folder"):
            step(database, blobs, NONE)


def test_the_policy_sets_aside_and_deletes_after_its_days(
    orphan: str, database: Database, blobs: BlobStore, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level("INFO")
    vouch_for_the_clock(database)
    policy = Retention(database, blobs, None, lambda: True, unreferenced_days=7.0)
    policy._look()
    assert list(blobs.quarantine.hashes()) == [orphan]
    grow_old(tmp_path / "quarantine" / orphan, days=8.0)
    policy._look()  # not yet: each is a walk over all files
    assert list(blobs.quarantine.hashes()) == [orphan]
    policy._next_garbage = 0.0
    policy._look()
    assert list(blobs.quarantine.hashes()) == []
    assert "set 1 files aside" in caplog.text
    assert "deleted 1 files" in caplog.text


@ONLY_SQLITE
def test_the_command_tells_and_only_with_delete_does(
    orphan: str,
    database: Database,
    blobs: BlobStore,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def run(*options: str) -> tuple[int, list[str]]:
        with pytest.raises(SystemExit) as ending:
            main(["blobs", "prune", "--database-url", database.url, *options])
        return int(ending.value.code or 0), capsys.readouterr().out.splitlines()

    monkeypatch.setenv("STICTION_DATA_FOLDER", str(tmp_path))
    deleted = "0 unreferenced files would be deleted, which are in quarantine for 7 days"
    assert run() == (0, [deleted, "1 unreferenced files would be set aside"])
    assert blobs.has(orphan)
    told = json.loads("".join(run("--json")[1]))
    assert told == {"deleted": False, "unreferenced": {"files": 0, "set_aside": 1}}
    assert run("--delete") == (0, ["deleted 0 unreferenced files", "set 1 unreferenced files aside"])
    assert run("--delete", "--grace", "0h") == (0, ["deleted 1 unreferenced files", "set 0 unreferenced files aside"])
    assert list(blobs.quarantine.hashes()) == []
    assert [(entry.actor.name, entry.details["files"]) for entry in recorded(database)] == [(command_actor().name, 1)]
    assert run("--delete", "--dry-run")[0] == 2
