import shutil
import sqlite3
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest

from db.database import Database
from db.errors import StorageUnavailable
from db.migrate import upgrade
from db.repositories import stores
from db.sqlite_file import SIDE_FILES, SqliteFile


@pytest.mark.parametrize("suffix", SIDE_FILES)
def test_a_look_makes_no_file_in_place_of_one_that_is_gone(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / "database"
    connection = sqlite3.connect(path)
    connection.execute("PRAGMA journal_mode = WAL")
    connection.execute("CREATE TABLE log (id)")
    file = SqliteFile(str(path))
    file.note_opened(connection)
    file.check_head()
    beside = Path(f"{path}{suffix}")
    beside.rename(tmp_path / "away")
    with pytest.raises(StorageUnavailable, match=suffix):
        file.check_head()
    assert not beside.exists()
    connection.close()


def grow(database: Database) -> None:
    with database.write() as session:
        session.connection().exec_driver_sql("CREATE TABLE more AS SELECT randomblob(100000)")


def look(database: Database) -> None:
    with database.write() as session:
        stores.touch(session)


@pytest.mark.parametrize("change", [grow, look])
def test_an_older_copy_over_the_file_is_noticed(tmp_path: Path, change: Callable[[Database], None]) -> None:
    """With the inode of before, once the write-ahead log holds nothing that would hide it."""
    path = tmp_path / "stiction.sqlite3"
    database = Database(f"sqlite:///{path}")
    upgrade(database)
    with database.connect() as connection:
        connection.exec_driver_sql("PRAGMA wal_checkpoint(TRUNCATE)")
    shutil.copyfile(path, tmp_path / "older")
    change(database)
    with database.connect() as connection:
        connection.exec_driver_sql("PRAGMA wal_checkpoint(TRUNCATE)")
    database.ping()
    shutil.copyfile(tmp_path / "older", path)
    with pytest.raises(StorageUnavailable, match="deleted or replaced"):
        database.ping()
    database.close()


def test_an_older_copy_of_the_same_size_is_noticed_before_a_write(tmp_path: Path) -> None:
    """SQLite finds header and changes in the write-ahead log and would write on into a mixture of both."""
    path = tmp_path / "stiction.sqlite3"
    with closing(Database(f"sqlite:///{path}")) as database:
        upgrade(database)
        database.checkpoint()
        shutil.copyfile(path, tmp_path / "older")
        look(database)
        database.checkpoint()
        assert path.stat().st_size == (tmp_path / "older").stat().st_size
        look(database)
        shutil.copyfile(tmp_path / "older", path)
        with pytest.raises(StorageUnavailable, match="deleted or replaced"):
            look(database)


def test_reading_the_header_leaves_the_locks_of_a_write_to_sqlite(tmp_path: Path) -> None:
    """POSIX locks of a process end with any descriptor of the file that it closes."""
    path = tmp_path / "stiction.sqlite3"
    with closing(Database(f"sqlite:///{path}")) as database:
        upgrade(database)
        with database.write() as session:
            before = locks_of(path)
            look = sqlite3.connect(f"{path.as_uri()}?immutable=1", uri=True)
            look.execute("PRAGMA user_version").fetchone()
            look.close()
            database.ping()
            assert locks_of(path) == before
            assert session.connection().exec_driver_sql("SELECT count(*) FROM store").scalar_one() >= 0
        assert before


def locks_of(path: Path) -> set[str]:
    """What the system says of locks on the file and on the index of its write-ahead log."""
    inodes = {Path(f"{path}{suffix}").stat().st_ino for suffix in ("", "-shm")}
    lines = Path("/proc/locks").read_text(encoding="ascii").splitlines()
    return {line.split(":", 1)[1] for line in lines if int(line.split()[5].rsplit(":", 1)[1]) in inodes}


def test_a_thread_that_looked_earlier_finds_no_fault_in_what_grew_meanwhile(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Commits of other threads make the file larger between a look at it and the comparison."""
    path = tmp_path / "database"
    with closing(sqlite3.connect(path, isolation_level=None)) as connection:
        connection.execute("CREATE TABLE log (id)")
        file = SqliteFile(str(path))
        file.note_opened(connection)
        stat, ask, others = SqliteFile._stat, SqliteFile._ask, iter(range(2))

        def seen_before_others(looked: Callable[..., Any]) -> Callable[..., Any]:
            def look(self: SqliteFile, *given: str) -> Any:
                found = looked(self, *given)
                for number in others:
                    connection.execute(f"CREATE TABLE more{number} AS SELECT randomblob(100000)")
                    connection.execute(f"PRAGMA user_version = {number + 1}")
                    self.check_head()
                return found

            return look

        monkeypatch.setattr(SqliteFile, "_stat", seen_before_others(stat))
        file.require()
        others = iter(range(2, 4))
        monkeypatch.setattr(SqliteFile, "_stat", stat)
        monkeypatch.setattr(SqliteFile, "_ask", seen_before_others(ask))
        file.check_head()
