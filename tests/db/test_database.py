import threading
from pathlib import Path

import pytest
from sqlalchemy import text

from db.database import Database
from db.errors import StorageUnavailable
from db.repositories import materials


def pragma(database: Database, name: str) -> object:
    with database.read() as session:
        return session.execute(text(f"PRAGMA {name}")).scalar_one()


@pytest.mark.parametrize(
    ("name", "value"),
    [("journal_mode", "wal"), ("foreign_keys", 1), ("synchronous", 2), ("busy_timeout", 200)],
)
def test_sqlite_is_set_up_to_keep_what_it_accepted(database: Database, name: str, value: object) -> None:
    assert pragma(database, name) == value


def test_a_write_is_kept_as_a_whole_or_not_at_all(database: Database) -> None:
    def change() -> None:
        with database.write() as session:
            materials.create(session, "paper", "")
            raise KeyError("something goes wrong afterwards")

    with pytest.raises(KeyError):
        change()
    with database.read() as session:
        assert materials.list_all(session) == []


def test_changes_made_while_reading_are_dropped(database: Database) -> None:
    with database.read() as session:
        materials.create(session, "paper", "")
    with database.read() as session:
        assert materials.list_all(session) == []


def test_a_writer_that_reads_first_waits_for_the_other_writer(database: Database) -> None:
    """With SQLite's deferred transactions, one of two that read and then write fails at once, whatever the timeout."""
    patient = Database(database.url, busy_timeout=10.0)
    first_has_read, second_started = threading.Event(), threading.Event()

    def first() -> None:
        with patient.write() as session:
            assert materials.list_all(session) == []
            first_has_read.set()
            second_started.wait(10)
            materials.create(session, "first", "")

    thread = threading.Thread(target=first)
    thread.start()
    assert first_has_read.wait(10)
    second_started.set()
    with patient.write() as session:
        seen = [material.name for material in materials.list_all(session)]
        materials.create(session, "second", "")
    thread.join()
    patient.close()
    assert seen == ["first"]


def test_readers_do_not_wait_for_a_writer(database: Database) -> None:
    with database.write() as writing:
        materials.create(writing, "paper", "")
        with database.read() as reading:
            assert materials.list_all(reading) == []


def test_a_lock_held_too_long_is_named(database: Database) -> None:
    with (
        database.write(),
        pytest.raises(StorageUnavailable, match="database is locked"),
        database.write(),
    ):
        raise AssertionError("two writers at once")


def test_a_database_that_cannot_be_opened_is_named(tmp_path: Path) -> None:
    database = Database(f"sqlite:///{tmp_path / 'no such folder' / 'x.sqlite3'}")
    with pytest.raises(StorageUnavailable, match="unable to open database file"):
        database.ping()
    database.close()


def test_ping_answers_when_all_is_well(database: Database) -> None:
    assert database.ping() is None
    assert database.is_sqlite
