from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path

import pytest
from sqlalchemy.orm import Session

from db import identity, migrate
from db.backup import backup, restore
from db.blobs import BlobStore, open_blobs
from db.database import Database
from db.errors import StorageUnavailable, StoreMismatch
from db.paging import Window
from db.records import Actor, AuditEntry, AuditFilter, NewGraspLog
from db.repositories import audit, grasp_logs, stores

OPERATOR = Actor("command:operator")
NewLog = Callable[..., NewGraspLog]


@pytest.fixture(params=["folder", "s3"])
def blobs(tmp_path: Path, request: pytest.FixtureRequest) -> BlobStore:
    if request.param == "folder":
        return BlobStore(tmp_path / "data")
    request.getfixturevalue("s3")
    return open_blobs(tmp_path / "data", "s3://grasps/lab", 2**30)


@pytest.fixture
def other(new_url: Callable[..., str], tmp_path: Path) -> Iterator[Database]:
    (tmp_path / "other").mkdir()
    with closing(Database(new_url(tmp_path / "other"))) as database:
        yield database


@pytest.fixture
def refer(new_log: NewLog) -> Callable[[Database, BlobStore, bytes], str]:
    """Store a blob, and a row that refers to it."""

    def store(database: Database, blobs: BlobStore, content: bytes) -> str:
        sha256 = blobs.put(content)
        with database.write() as session:
            grasp_logs.add(session, new_log(sha256=sha256))
        return sha256

    return store


class Died(BaseException):
    """The process is no more: nothing in it goes on."""


def raising(*_: object) -> None:
    raise Died


def die_before_the_row(database: Database, blobs: BlobStore, monkeypatch: pytest.MonkeyPatch) -> None:
    """A first start that has named the files' store, and not yet the database's."""
    with monkeypatch.context() as dying:
        dying.setattr(stores, "set_id", raising)
        with pytest.raises(Died):
            join(database, blobs)


def nothing(what: str, count: int) -> None:
    pass


def last_entry(database: Database) -> AuditEntry:
    with database.read() as session:
        return audit.list_all(session, Window("id", descending=True, limit=1), AuditFilter())[0]


def store_id(database: Database) -> str | None:
    with database.read() as session:
        return stores.find_id(session)


def join(database: Database, blobs: BlobStore) -> None:
    identity.join(database, blobs, alone=True)


def test_two_new_ones_get_a_common_id_and_keep_it(database: Database, blobs: BlobStore) -> None:
    join(database, blobs)
    first = store_id(database)
    assert first is not None
    assert (database.store_id, blobs.store_id, blobs.read_store_id()) == (first, first, first)
    join(database, blobs)
    assert store_id(database) == first


def test_two_of_before_are_joined_where_all_is_there(
    database: Database, blobs: BlobStore, refer: Callable[..., str]
) -> None:
    refer(database, blobs, b"tactile")
    blobs.put(b"to which nothing refers")
    join(database, blobs)
    assert store_id(database) == blobs.read_store_id() is not None


def test_a_database_that_knows_no_file_is_refused_where_there_are_some(database: Database, blobs: BlobStore) -> None:
    sha256 = blobs.put(b"tactile")
    with pytest.raises(StoreMismatch, match=r"has files, and database .* refers to none; allowed: .*stiction db adopt"):
        join(database, blobs)
    assert (store_id(database), blobs.read_store_id(), list(blobs.hashes())) == (None, None, [sha256])


def test_a_database_whose_files_are_elsewhere_is_refused(
    database: Database, blobs: BlobStore, refer: Callable[..., str]
) -> None:
    refer(database, blobs, b"one")
    blobs.remove([refer(database, blobs, b"two")])
    with pytest.raises(StoreMismatch, match=r"1 of the 2 files that database .* refers to are not in blob"):
        join(database, blobs)


@pytest.mark.parametrize("is_used", [False, True])
def test_another_database_or_another_folder_is_refused_by_name(
    database: Database, blobs: BlobStore, other: Database, tmp_path: Path, refer: Callable[..., str], *, is_used: bool
) -> None:
    join(database, blobs)
    if is_used:
        refer(database, blobs, b"tactile")
    elsewhere = BlobStore(tmp_path / "elsewhere")
    with pytest.raises(StoreMismatch, match=rf"is of store {store_id(database)}, and blob folder .* of no store yet"):
        join(database, elsewhere)
    join(other, elsewhere)
    for wrong in ((database, elsewhere), (other, blobs)):
        for use in (join, identity.verify):
            with pytest.raises(StoreMismatch, match=store_id(wrong[0])):
                use(*wrong)
    join(database, blobs)


def test_a_first_start_that_died_before_its_row_begins_anew(
    database: Database, blobs: BlobStore, other: Database, monkeypatch: pytest.MonkeyPatch
) -> None:
    """But not while others work in the folder: one of them may be about to write its row."""
    die_before_the_row(database, blobs, monkeypatch)
    with pytest.raises(StoreMismatch, match=r"of no store yet, and .* of store"):
        identity.join(other, blobs, alone=False)
    join(other, blobs)
    assert blobs.read_store_id() == store_id(other) is not None
    with pytest.raises(StoreMismatch):
        join(database, blobs)


def test_files_of_a_first_start_that_died_can_be_filled_while_there_are_none(
    database: Database, blobs: BlobStore, other: Database, monkeypatch: pytest.MonkeyPatch
) -> None:
    die_before_the_row(database, blobs, monkeypatch)
    identity.check_to_fill(other, blobs)
    blobs.put(b"somebody's")
    with pytest.raises(StoreMismatch):
        identity.check_to_fill(other, blobs)


def test_a_first_start_that_died_after_its_row_goes_on(
    database: Database, blobs: BlobStore, monkeypatch: pytest.MonkeyPatch
) -> None:
    settled, write = [], BlobStore.write_store_id

    def dying_once_settled(store: BlobStore, name: str, **more: bool) -> None:
        settled.append(more.get("settled", True))
        if settled[-1]:
            raise Died
        write(store, name, **more)

    with monkeypatch.context() as dying:
        dying.setattr(BlobStore, "write_store_id", dying_once_settled)
        with pytest.raises(Died):
            join(database, blobs)
    assert (settled, blobs.is_settled) == ([False, True], False)
    known = store_id(database)
    join(database, blobs)
    assert (blobs.is_settled, blobs.read_store_id(), store_id(database)) == (True, known, known)


def test_blobs_of_a_store_without_uploads_are_no_other_databases(
    database: Database, blobs: BlobStore, other: Database
) -> None:
    join(database, blobs)
    for use in (join, identity.verify_before_upgrade):
        with pytest.raises(StoreMismatch, match=r"of no store yet, and .* of store"):
            use(other, blobs)
    join(database, blobs)


def test_of_two_that_begin_at_once_in_an_object_store_one_is_refused(
    database: Database, other: Database, s3: object, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Machines know nothing of each other's locks."""
    assert s3 is not None
    first, second = (open_blobs(tmp_path / name, "s3://grasps/lab", 2**30) for name in ("first", "second"))
    set_id = stores.set_id

    def set_id_after_another_began(session: Session, store_id: str) -> None:
        monkeypatch.setattr(stores, "set_id", set_id)
        join(other, second)
        set_id(session, store_id)

    monkeypatch.setattr(stores, "set_id", set_id_after_another_began)
    with pytest.raises(StoreMismatch, match=r"is of store .* of store"):
        join(database, first)
    join(other, second)
    assert second.put(b"tactile")


def test_what_another_database_took_over_takes_no_more_files(
    database: Database, blobs: BlobStore, other: Database
) -> None:
    join(database, blobs)
    assert blobs.put(b"tactile")
    store_id = blobs.store_id
    identity.adopt(other, blobs, OPERATOR)
    blobs.store_id = store_id  # as another process still has it
    with pytest.raises(StorageUnavailable, match="its store id was"):
        blobs.put(b"lost")


def test_a_folder_of_files_becomes_no_cache_of_another_store(
    database: Database, other: Database, s3: object, tmp_path: Path
) -> None:
    assert s3 is not None
    join(database, BlobStore(tmp_path / "one"))
    join(other, open_blobs(tmp_path / "two", "s3://grasps/lab"))
    with pytest.raises(StoreMismatch, match="to be the cache of"):
        join(other, open_blobs(tmp_path / "one", "s3://grasps/lab"))


def test_a_person_can_join_two_and_what_worked_with_them_is_refused(
    database: Database, blobs: BlobStore, other: Database, refer: Callable[..., str]
) -> None:
    join(database, blobs)
    refer(database, blobs, b"tactile")
    adopted = identity.adopt(other, blobs, OPERATOR)
    assert (adopted.referenced, adopted.missing) == (0, 0)
    join(other, blobs)
    with pytest.raises(StoreMismatch):
        join(database, blobs)
    adopted = identity.adopt(database, blobs, OPERATOR)
    assert (adopted.referenced, adopted.missing) == (1, 0)
    join(database, blobs)
    entry = last_entry(database)
    assert (entry.actor, entry.action, entry.subject) == (OPERATOR, "store.adopted", adopted.store_id)
    assert entry.details == {"referenced": 1, "missing": 0}


def test_a_database_that_was_replaced_is_noticed_inside_a_transaction(database: Database, blobs: BlobStore) -> None:
    join(database, blobs)
    with database.write() as session:
        stores.require(session, database.store_id)
        stores.set_id(session, "0" * 32)
        with pytest.raises(StorageUnavailable, match="another database is in its place"):
            stores.require(session, database.store_id)


def test_a_restored_store_is_one_of_its_own(
    database: Database, other: Database, tmp_path: Path, refer: Callable[..., str]
) -> None:
    blobs, again = BlobStore(tmp_path / "data"), BlobStore(tmp_path / "again")
    join(database, blobs)
    refer(database, blobs, b"tactile")
    backup(database, blobs, tmp_path / "copy", nothing)
    with pytest.raises(StoreMismatch, match="of no store yet"):
        restore(tmp_path / "copy", other, blobs, nothing)
    restore(tmp_path / "copy", other, again, nothing)
    join(other, again)
    join(database, blobs)
    assert store_id(other) != store_id(database)


def test_a_restore_can_take_the_files_over(
    database: Database, other: Database, tmp_path: Path, refer: Callable[..., str]
) -> None:
    """The database is lost, its files are not."""
    blobs = BlobStore(tmp_path / "data")
    join(database, blobs)
    sha256 = refer(database, blobs, b"tactile")
    with database.write() as session:
        audit.add(session, OPERATOR, "material.created", "paper")
    backup(database, blobs, tmp_path / "copy", nothing)
    restore(tmp_path / "copy", other, blobs, nothing, taken_over_by=OPERATOR)
    join(other, blobs)
    entry = last_entry(other)
    assert (entry.actor, entry.action, entry.subject) == (OPERATOR, "store.taken_over", store_id(other))
    assert entry.details["rows"]["grasp_logs"] == 1
    assert blobs.path(sha256).read_bytes() == b"tactile"
    with pytest.raises(StoreMismatch):
        join(database, blobs)


def test_the_way_back_and_forth_wants_a_hand(database: Database, blobs: BlobStore, refer: Callable[..., str]) -> None:
    """Who worked with the files meanwhile is not known."""
    join(database, blobs)
    refer(database, blobs, b"tactile")
    migrate.downgrade(database, "0010")
    migrate.upgrade(database)
    with pytest.raises(StoreMismatch, match="stiction db adopt"):
        join(database, blobs)
