import hashlib
import sqlite3
import subprocess
from collections.abc import Callable, Iterator
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import pytest
from sqlalchemy import inspect, select, update

from db import migrate
from db.backup import FILE, LACKING, LEFT_OUT, _copy_rows, backup, restore
from db.blobs import BlobStore
from db.database import Database
from db.errors import BlobDamaged, NotEmpty, NotFound, SchemaMismatch, StorageUnavailable, StoreMismatch
from db.paging import Window
from db.records import Actor, AuditFilter, Claim, Detection, NewGraspLog, NewModel, SampleSummary
from db.repositories import (
    access_keys,
    audit,
    detections,
    friction_models,
    grasp_logs,
    jobs,
    materials,
    runners,
    stores,
)
from db.sqlite_file import SIDE_FILES
from db.tables import Base, GraspLogRow, MaterialRow

Rows = dict[str, list[dict[str, object]]]


@pytest.fixture
def blobs(tmp_path: Path) -> BlobStore:
    return BlobStore(tmp_path / "data")


@pytest.fixture
def filled(
    database: Database,
    blobs: BlobStore,
    new_log: Callable[..., NewGraspLog],
    new_model: Callable[..., NewModel],
    detection: Detection,
    samples: SampleSummary,
) -> Database:
    """Two logs of a material: one with everything, one whose job runs."""
    history, found = blobs.put(b"history"), blobs.put(b"samples")
    with database.write() as session:
        material = materials.create(session, "paper", "a box")
        merged, last = materials.create(session, "card", ""), materials.create(session, "board", "")
        session.execute(update(MaterialRow).where(MaterialRow.id == merged.id).values(merged_into_id=last.id))
        done, running = (
            grasp_logs.add(session, new_log(material.id, sha256=blobs.put(content))) for content in (b"one", b"two")
        )
        job = jobs.add(session, "ingest", "ols", material_id=material.id, grasp_log_id=done)
        detections.add(session, done, replace(detection, history_blob=history), replace(samples, samples_blob=found))
        friction_models.add(session, material.id, job, new_model())
        owner = runners.add(session, "host:1")
        claim = jobs.claim(session, owner)
        assert claim == Claim(job, owner)
        jobs.finish(session, claim, "done", model_version=1)
        jobs.add(session, "ingest", "ols", material_id=material.id, grasp_log_id=running)
        jobs.claim(session, owner)
        access_keys.add(session, "0" * 12, "robot", "read", history)
    return database


@pytest.fixture
def other(new_url: Callable[..., str], tmp_path: Path) -> Iterator[Database]:
    """An empty database of the same kind."""
    (tmp_path / "other").mkdir()
    with closing(Database(new_url(tmp_path / "other", empty=True))) as database:
        yield database


def rows(database: Database) -> Rows:
    with database.read() as session:
        return {
            table.name: [dict(row) for row in session.execute(select(table).order_by(*table.primary_key)).mappings()]
            for table in Base.metadata.sorted_tables
            if table.name not in LEFT_OUT
        }


def blob_of(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()


def nothing(what: str, count: int) -> None:
    pass


def test_what_was_stored_is_there_again_and_running_jobs_are_queued(
    filled: Database, blobs: BlobStore, other: Database, tmp_path: Path
) -> None:
    told: list[tuple[str, int]] = []
    folder = tmp_path / "a copy of 100%25? #1"
    backup(filled, blobs, folder, lambda what, count: told.append((what, count)))
    assert {("materials", 3), ("grasp_logs", 2), ("jobs", 2), ("blobs", 4)} <= set(told)
    again = BlobStore(tmp_path / "again")
    restore(folder, other, again, nothing)
    wanted = rows(filled)
    for job in wanted["jobs"]:
        job |= {"runner_id": None, "status": "queued" if job["status"] == "running" else job["status"]}
    assert rows(other) == wanted
    assert {again.path(sha256).read_bytes() for sha256 in again.hashes()} == {b"one", b"two", b"history", b"samples"}


def test_a_restored_database_goes_on_with_new_rows(
    filled: Database, blobs: BlobStore, other: Database, tmp_path: Path
) -> None:
    backup(filled, blobs, tmp_path / "copy", nothing)
    restore(tmp_path / "copy", other, blobs, nothing)
    with other.write() as session:
        assert materials.create(session, "glass", "").id == 4
        assert jobs.claim(session, runners.add(session, "host:2")) is not None


@pytest.mark.parametrize("part", ["", "blobs", "blobs/copy", "spool", "quarantine"])
def test_a_backup_among_the_blobs_themselves_is_refused(
    filled: Database, blobs: BlobStore, tmp_path: Path, part: str
) -> None:
    with pytest.raises(NotEmpty, match=r"blob folder .* is there already; allowed: a folder outside of it"):
        backup(filled, blobs, tmp_path / "data" / part, nothing)
    assert not (tmp_path / "data" / "blobs" / "copy").exists()
    assert not [*(tmp_path / "data").rglob(FILE)]


@pytest.mark.parametrize("part", ["", "blobs"])
def test_a_backup_into_another_mount_of_the_data_folder_is_refused(
    filled: Database, blobs: BlobStore, tmp_path: Path, part: str
) -> None:
    mounted = tmp_path / "mounted" / part
    mounted.mkdir(parents=True)
    try:
        subprocess.run(["mount", "--bind", tmp_path / "data" / part, mounted], check=True, capture_output=True)
    except (OSError, subprocess.CalledProcessError) as error:
        pytest.skip(f"no mount without the right to it: {error}")
    try:
        with pytest.raises(NotEmpty, match="a folder outside of it"):
            backup(filled, blobs, tmp_path / "mounted", nothing)
    finally:
        subprocess.run(["umount", mounted], check=True)
    assert not [*(tmp_path / "mounted").rglob(FILE), *(tmp_path / "data").rglob(FILE)]


def test_a_backup_whose_blobs_are_the_services_own_is_refused_either_way(
    filled: Database, blobs: BlobStore, other: Database, tmp_path: Path
) -> None:
    (tmp_path / "linked").mkdir()
    (tmp_path / "linked" / "blobs").symlink_to(tmp_path / "data" / "blobs")
    with pytest.raises(NotEmpty, match="a folder outside of it"):
        backup(filled, blobs, tmp_path / "linked", nothing)
    backup(filled, blobs, tmp_path / "copy", nothing)
    with pytest.raises(NotEmpty, match="allowed: a data folder other than the backup's"):
        restore(tmp_path / "copy", other, BlobStore(tmp_path / "copy"), nothing)
    for part in ("blobs/data", "data", "data/of/robot"):
        with pytest.raises(NotEmpty, match="allowed: a data folder other than the backup's and outside of it"):
            restore(tmp_path / "copy", other, BlobStore(tmp_path / "copy" / part), nothing)
    restore(tmp_path / "copy", other, BlobStore(tmp_path / "again"), nothing)


def test_the_next_backup_copies_new_blobs_only(filled: Database, blobs: BlobStore, tmp_path: Path) -> None:
    told: dict[str, int] = {}
    backup(filled, blobs, tmp_path / "copy", nothing)
    with pytest.raises(NotEmpty, match=FILE):
        backup(filled, blobs, tmp_path / "copy", nothing)
    (tmp_path / "copy" / FILE).unlink()
    backup(filled, blobs, tmp_path / "copy", told.__setitem__)
    assert told["blobs"] == 0


def test_a_backup_that_was_killed_is_made_anew_in_the_same_folder(
    filled: Database, blobs: BlobStore, tmp_path: Path
) -> None:
    """What it leaves is a file that was begun, and its write-ahead log."""
    backup(filled, blobs, tmp_path / "copy", nothing)
    file = tmp_path / "copy" / FILE
    begun = file.with_suffix(".part")
    file.rename(begun)
    with closing(sqlite3.connect(begun)) as connection:
        connection.execute("UPDATE materials SET description = 'begun'")
        connection.commit()
        left = {suffix: Path(f"{begun}{suffix}").read_bytes() for suffix in SIDE_FILES}
    for suffix, content in left.items():
        Path(f"{begun}{suffix}").write_bytes(content)
    (tmp_path / "copy" / "spool" / "half of a blob").write_bytes(b"o")
    for _ in range(2):
        backup(filled, blobs, tmp_path / "copy", nothing)
        assert not [*(tmp_path / "copy" / "spool").iterdir()]
        assert [path.name for path in (tmp_path / "copy").glob("*.*")] == [FILE]
        file.unlink()


def test_a_backup_goes_on_where_an_old_upload_is_deleted_meanwhile(
    filled: Database, blobs: BlobStore, tmp_path: Path
) -> None:
    told: list[str] = []

    def deleting(what: str, _count: int) -> None:
        told.append(what)
        if what == "blobs" and told.count("blobs") == 1:  # when the rows are copied
            with filled.write() as session:
                session.execute(update(GraspLogRow).values(file_state="gone"))
            blobs.remove(sha256 for sha256 in (blob_of(b"one"), blob_of(b"two")))

    backup(filled, blobs, tmp_path / "backup", deleting)
    assert told.count("grasp_logs") == 2
    with closing(Database(f"sqlite:///{tmp_path / 'backup' / FILE}")) as copy, copy.read() as session:
        assert set(session.scalars(select(GraspLogRow.file_state))) == {"gone"}


def test_files_that_are_missing_or_damaged_are_named_and_all_else_is_backed_up(
    filled: Database, other: Database, blobs: BlobStore, tmp_path: Path
) -> None:
    """One of them had made every backup impossible, for ever where it cannot be sent again."""
    folder, again = tmp_path / "backup", BlobStore(tmp_path / "again")
    blobs.remove([blob_of(b"one")])
    blobs.path(blob_of(b"two")).write_bytes(b"2wo")
    told = backup(filled, blobs, folder, nothing)
    assert sorted(line.split(blob_of(b"one"))[0].split(blob_of(b"two"))[0] for line in told) == ["blob ", "no blob '"]
    assert set((folder / LACKING).read_text().split()) == {blob_of(b"one"), blob_of(b"two")}
    lacking = restore(folder, other, again, nothing)
    assert sorted(lacking) == sorted(f"no blob {blob_of(each)!r} is stored" for each in (b"one", b"two"))
    assert len(rows(other)["grasp_logs"]) == 2
    assert set(again.hashes()) == {blob_of(b"history"), blob_of(b"samples")}


def test_a_backup_that_lacks_files_is_whole_once_they_are_back(
    filled: Database, other: Database, blobs: BlobStore, tmp_path: Path
) -> None:
    folder = tmp_path / "backup"
    blobs.remove([blob_of(b"one")])
    assert len(backup(filled, blobs, folder, nothing)) == 1
    BlobStore(folder).put(b"one")  # from an older backup
    assert restore(folder, other, BlobStore(tmp_path / "again"), nothing) == []
    (folder / FILE).unlink()
    assert backup(filled, blobs, folder, nothing) == []
    assert not (folder / LACKING).exists()


def test_two_backups_in_one_folder_do_not_meet(filled: Database, blobs: BlobStore, tmp_path: Path) -> None:
    refused = []

    def begin_another(_what: str, _count: int) -> None:
        with pytest.raises(NotEmpty, match=r"a backup under way in .* is there already; allowed: one at a time"):
            backup(filled, blobs, tmp_path / "backup", nothing)
        refused.append(True)

    backup(filled, blobs, tmp_path / "backup", begin_another)
    assert refused
    restorable = tmp_path / "backup" / FILE
    with closing(sqlite3.connect(restorable)) as copy:
        assert copy.execute("PRAGMA integrity_check").fetchone() == ("ok",)


def test_a_backup_whose_log_cannot_be_brought_into_its_file_is_none(
    filled: Database, blobs: BlobStore, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As on a disk that is full by then, of which SQLite says nothing when it closes; here somebody reads the file."""
    file = tmp_path / "copy" / FILE
    monkeypatch.setattr("db.backup._opened", lambda path: Database(f"sqlite:///{path}", lock_timeout=0.01))
    with closing(sqlite3.connect(tmp_path / "reader", isolation_level=None)) as reader:

        def read_meanwhile(what: str, _: int) -> None:
            if what == "materials":
                reader.execute(f"ATTACH '{file.with_suffix('.part')}' AS copy")
                reader.execute("BEGIN")
                reader.execute("SELECT count(*) FROM copy.materials").fetchone()

        with pytest.raises(StorageUnavailable, match="open elsewhere"):
            backup(filled, blobs, tmp_path / "copy", read_meanwhile)
    assert not file.exists()
    backup(filled, blobs, tmp_path / "copy", nothing)


@pytest.fixture(params=["no schema", "a missing blob", "files of another store"])
def refused(
    request: pytest.FixtureRequest, filled: Database, blobs: BlobStore, tmp_path: Path
) -> tuple[Path, BlobStore, str]:
    """A backup, a blob store that it is not restored into, and what is said of that."""
    copy, again = tmp_path / "copy", BlobStore(tmp_path / "again")
    backup(filled, blobs, copy, nothing)
    if request.param == "no schema":
        (copy / FILE).unlink()
        with closing(sqlite3.connect(copy / FILE)) as connection:
            connection.execute("CREATE TABLE other (id INTEGER)")
        return copy, again, "revision"
    if request.param == "a missing blob":
        sha256 = next(BlobStore(copy).hashes())
        BlobStore(copy).path(sha256).unlink()
        return copy, again, sha256
    again.write_store_id("0" * 32)
    return copy, again, "of store 0"


def test_a_restore_that_is_refused_makes_no_database(refused: tuple[Path, BlobStore, str], tmp_path: Path) -> None:
    copy, again, said = refused
    id_before, file = again.read_store_id(), tmp_path / "new" / "stiction.sqlite3"
    file.parent.mkdir()
    with (
        closing(Database(f"sqlite:///{file}")) as database,
        pytest.raises((SchemaMismatch, NotFound, StoreMismatch), match=said),
    ):
        restore(copy, database, again, nothing)
    assert list(file.parent.iterdir()) == []
    assert (again.read_store_id(), list(again.hashes())) == (id_before, [])


def test_a_restore_that_is_refused_leaves_an_empty_database_as_it_was(
    refused: tuple[Path, BlobStore, str], other: Database
) -> None:
    copy, again, said = refused
    with pytest.raises((SchemaMismatch, NotFound, StoreMismatch), match=said):
        restore(copy, other, again, nothing)
    with other.connect() as connection:
        assert inspect(connection).get_table_names() == []


def test_a_backup_of_an_older_version_is_restored_and_stays_as_it_is(
    filled: Database, other: Database, blobs: BlobStore, tmp_path: Path
) -> None:
    copy, before = tmp_path / "copy", rows(filled)
    backup(filled, blobs, copy, nothing)
    with closing(Database(f"sqlite:///{copy / FILE}")) as database:
        migrate.downgrade(database, "0026", lose=True)
        database.empty_log()
    content = (copy / FILE).read_bytes()
    restore(copy, other, BlobStore(tmp_path / "again"), nothing)
    after = rows(other)
    assert {name: len(found) for name, found in after.items()} == {name: len(found) for name, found in before.items()}
    assert [each["sha256"] for each in after["grasp_logs"]] == [each["sha256"] for each in before["grasp_logs"]]
    assert (copy / FILE).read_bytes() == content


def test_a_blob_that_changed_or_went_stops_a_restore_before_any_row(
    filled: Database, blobs: BlobStore, other: Database, tmp_path: Path
) -> None:
    backup(filled, blobs, tmp_path / "copy", nothing)
    sha256 = next(BlobStore(tmp_path / "copy").hashes())
    path = BlobStore(tmp_path / "copy").path(sha256)
    content = path.read_bytes()
    path.write_bytes(content + b"!")
    with pytest.raises(BlobDamaged, match=sha256):
        restore(tmp_path / "copy", other, BlobStore(tmp_path / "again"), nothing)
    path.unlink()
    with pytest.raises(NotFound, match=sha256):
        restore(tmp_path / "copy", other, BlobStore(tmp_path / "again"), nothing)
    assert not any(rows(other).values())
    path.write_bytes(content)
    restore(tmp_path / "copy", other, BlobStore(tmp_path / "again"), nothing)


def test_only_an_empty_database_is_filled_and_only_from_a_backup(
    filled: Database, blobs: BlobStore, tmp_path: Path
) -> None:
    backup(filled, blobs, tmp_path / "copy", nothing)
    with pytest.raises(NotEmpty, match="rows"):
        restore(tmp_path / "copy", filled, blobs, nothing)
    with pytest.raises(FileNotFoundError, match="nowhere"):
        restore(tmp_path / "nowhere", filled, blobs, nothing)


@pytest.mark.parametrize(
    ("unseen", "told"), [(["_refuse_rows"], "rows"), (["_refuse_rows", "_refuse_rows_in"], "just")]
)
def test_a_database_that_is_filled_meanwhile_stays_as_it_is(
    filled: Database, blobs: BlobStore, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, unseen: list[str], told: str
) -> None:
    backup(filled, blobs, tmp_path / "copy", nothing)
    before = rows(filled)
    for look in unseen:  # as if it had come before the other's rows
        monkeypatch.setattr(f"db.backup.{look}", lambda _database: None)
    with pytest.raises(NotEmpty, match=told):
        restore(tmp_path / "copy", filled, blobs, nothing)
    assert rows(filled) == before


def test_a_database_of_another_version_is_not_backed_up(
    empty_database: Database, blobs: BlobStore, tmp_path: Path
) -> None:
    migrate.upgrade(empty_database, "0001")
    with pytest.raises(SchemaMismatch, match="0001"):
        backup(empty_database, blobs, tmp_path / "copy", nothing)
    assert not (tmp_path / "copy").exists()


@pytest.mark.parametrize("engine_name", ["sqlite"], indirect=True)
def test_a_take_over_is_recorded_with_the_store_that_is_filled(filled: Database, other: Database) -> None:
    migrate.upgrade(other)
    with other.write() as session:
        stores.set_id(session, "5" * 32)
    _copy_rows(filled, other, nothing, Actor("command:me"))
    with other.read() as session:
        (entry,) = audit.list_all(session, Window("id"), AuditFilter())
    assert (entry.actor.name, entry.action, entry.subject) == ("command:me", "store.taken_over", "5" * 32)
    assert entry.details["rows"]["materials"] == 3
