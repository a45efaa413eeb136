import os
import shutil
import sqlite3
import subprocess
import sys
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest

from db.backup import backup
from db.blobs import BlobStore
from db.database import Database
from db.errors import InvalidUrl, StorageUnavailable
from db.file_header import FileHeader, after, is_older
from db.migrate import upgrade
from db.sqlite_file import SIDE_FILES, SqliteFile
from db.write_ahead_log import headers
from tests.db.looks import header_of, look

pytestmark = pytest.mark.usefixtures("without_pauses")


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


def test_an_older_copy_over_the_file_is_noticed(tmp_path: Path) -> None:
    """With the inode of before, once the write-ahead log holds nothing that would hide it."""
    path = tmp_path / "stiction.sqlite3"
    database = Database(f"sqlite:///{path}")
    upgrade(database)
    database.empty_log()
    shutil.copyfile(path, tmp_path / "older")
    look(database)
    database.empty_log()
    database.ping()
    shutil.copyfile(tmp_path / "older", path)
    with pytest.raises(StorageUnavailable, match="deleted or replaced"):
        database.ping()
    database.close()


def test_a_file_that_gives_back_room_is_the_same_file(tmp_path: Path) -> None:
    """As VACUUM makes it do, by an operator beside the service."""
    path = tmp_path / "stiction.sqlite3"
    with closing(Database(f"sqlite:///{path}")) as database:
        upgrade(database)
        with database.write() as session:
            session.connection().exec_driver_sql("CREATE TABLE more AS SELECT randomblob(1000000)")
            session.connection().exec_driver_sql("DROP TABLE more")
        database.checkpoint()
        look(database)
        before = path.stat().st_size
        with closing(sqlite3.connect(path)) as operator:
            operator.execute("VACUUM")
        database.empty_log()
        assert path.stat().st_size < before
        look(database)
        database.ping()


OVERWRITTEN = """
import gc, subprocess, sys
from contextlib import suppress
from db.database import Database
from db.errors import StorageUnavailable
from db.errors import InvalidUrl, StorageUnavailable
from db.migrate import upgrade
from db.repositories import stores

path, older = sys.argv[1:]
database = Database("sqlite:///" + path)
upgrade(database)

def look():
    with database.write() as session:
        stores.touch(session)
    database.checkpoint()

look()
subprocess.run(["cp", path, older], check=True)  # a copy made here would end SQLite's locks
for _ in range(3):
    look()
with database.connect() as connection:
    connection.exec_driver_sql("PRAGMA wal_checkpoint(TRUNCATE)")
with database.write() as session:
    stores.touch(session)
subprocess.run(["cp", older, path], check=True)
with suppress(StorageUnavailable):
    database.ping()
gc.collect()
database.close()
"""


def test_an_older_copy_gets_nothing_of_the_log_of_a_newer_file(tmp_path: Path) -> None:
    """Neither when the process ends, nor from a start, which is refused until the log was moved away."""
    path, older = tmp_path / "stiction.sqlite3", tmp_path / "older"
    subprocess.run([sys.executable, "-c", OVERWRITTEN, str(path), str(older)], check=True, timeout=120)
    assert path.read_bytes() == older.read_bytes()
    for _ in range(2):
        named = pytest.raises(StorageUnavailable, match=r"-wal follows: another copy was put in its place.*move away")
        with closing(Database(f"sqlite:///{path}")) as database, named:
            database.ping()
        assert path.read_bytes() == older.read_bytes()
    for suffix in SIDE_FILES:
        Path(f"{path}{suffix}").unlink(missing_ok=True)
    with closing(Database(f"sqlite:///{path}")) as database:
        database.ping()
        database.check_pages()


IDLE = """
import subprocess, sys
from db.database import Database
from db.migrate import upgrade
from db.repositories import stores

path, older = sys.argv[1:]
idle, busy = Database("sqlite:///" + path), Database("sqlite:///" + path)
upgrade(idle)
for _ in range(3):
    with busy.write() as session:
        stores.touch(session)
    busy.checkpoint()
    if not _:
        subprocess.run(["cp", path, older], check=True)
with busy.write() as session:
    stores.touch(session)
busy.close()
subprocess.run(["cp", older, path], check=True)
idle.close()
"""


def test_who_looked_last_before_the_copy_writes_no_log_into_it_either(tmp_path: Path) -> None:
    """What it knows is older than the copy: the log tells that this follows another file."""
    path, older = tmp_path / "stiction.sqlite3", tmp_path / "older"
    subprocess.run([sys.executable, "-c", IDLE, str(path), str(older)], check=True, timeout=120)
    assert path.read_bytes() == older.read_bytes()


def test_no_database_is_made_beside_the_log_of_one_that_is_gone(tmp_path: Path) -> None:
    """As after a slip with mv: SQLite would delete the log, and with it what was accepted last."""
    path, log = tmp_path / "stiction.sqlite3", tmp_path / "stiction.sqlite3-wal"
    with closing(Database(f"sqlite:///{path}")) as database:
        upgrade(database)
        look(database)
        content = log.read_bytes()
    log.write_bytes(content)
    path.rename(tmp_path / "away")
    named = pytest.raises(StorageUnavailable, match="is not there, and its write-ahead log")
    with closing(Database(f"sqlite:///{path}")) as database, named:
        upgrade(database)
    assert (path.exists(), log.read_bytes()) == (False, content)


def test_a_log_that_was_not_written_to_the_file_yet_is_its_own(tmp_path: Path) -> None:
    """However often it was looked at since, and although another process has both open."""
    path = tmp_path / "stiction.sqlite3"
    with closing(Database(f"sqlite:///{path}")) as database:
        upgrade(database)
        database.empty_log()
        for _ in range(5):
            look(database)
        assert headers(Path(f"{path}-wal"))[0].follows(header_of(path))
        with closing(Database(f"sqlite:///{path}")) as other:
            other.ping()
        look(database)


def test_each_log_says_which_file_it_follows(tmp_path: Path) -> None:
    """Also one that begins with a write that does not change the file's size, as a runner's lease does."""
    path = tmp_path / "stiction.sqlite3"
    with closing(Database(f"sqlite:///{path}")) as database:
        upgrade(database)
        look(database)
        for _ in range(3):
            before = header_of(path)
            database.empty_log()
            with database.write() as session:
                session.connection().exec_driver_sql("UPDATE store SET id = id")
            log = headers(Path(f"{path}-wal"))
            assert (len(log), log[0].follows(header_of(path)), log[0].follows(before)) == (1, True, False)


def test_the_file_of_a_backup_belongs_to_no_log(tmp_path: Path) -> None:
    """It is a copy of rows, whose pages lie elsewhere."""
    path = tmp_path / "stiction.sqlite3"
    with closing(Database(f"sqlite:///{path}")) as database:
        upgrade(database)
        backup(database, BlobStore(tmp_path / "blobs"), tmp_path / "backup", lambda *_: None)
        look(database)
        file = (tmp_path / "backup" / "stiction.sqlite3").read_bytes()
        with path.open("r+b") as stream:  # the name and inode stay
            stream.write(file)
            stream.truncate()
        with pytest.raises(StorageUnavailable, match="deleted or replaced"):
            look(database)
    with closing(Database(f"sqlite:///{path}")) as database, pytest.raises(StorageUnavailable, match="another copy"):
        database.ping()
    assert path.read_bytes() == file


def test_generations_go_on_at_the_other_end_of_their_field() -> None:
    most = 2**31 - 1
    assert (after(0), after(most - 1), after(most), after(-1)) == (1, most, -most - 1, 0)
    assert is_older(most, after(most))
    assert not is_older(after(most), most)
    assert not is_older(5, 5)


@pytest.mark.parametrize("content", [None, b"", b"\x37" * 31, b"\x37" * 33, b"\x37" * 200])
def test_what_is_no_log_tells_no_generation(tmp_path: Path, content: bytes | None) -> None:
    log = tmp_path / "database-wal"
    if content is not None:
        log.write_bytes(content)
    assert headers(log) == []


@pytest.mark.parametrize("suffix", SIDE_FILES)
def test_files_beside_the_target_of_a_link_are_watched(tmp_path: Path, suffix: str) -> None:
    link = tmp_path / "stiction.sqlite3"
    (tmp_path / "disk").mkdir()
    link.symlink_to(tmp_path / "disk" / "database")
    with closing(Database(f"sqlite:///{link}")) as database:
        upgrade(database)
        look(database)
        (tmp_path / "disk" / f"database{suffix}").rename(tmp_path / "away")
        with pytest.raises(StorageUnavailable, match=suffix):
            look(database)


def test_a_log_that_is_begun_anew_between_two_looks_is_looked_at_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """File and log are not read in one moment: what was the file's last header may be in no log any more."""
    path, found = tmp_path / "stiction.sqlite3", iter([[FileHeader(7, 7 << 16 | 7, 7, 7)]] * 2)
    with closing(Database(f"sqlite:///{path}")) as database:
        upgrade(database)
        look(database)
        database.checkpoint()
        monkeypatch.setattr("db.sqlite_file.headers", lambda log: next(found, None) or headers(log))
        database.ping()
        assert next(found, None) is None


def test_a_file_is_named_by_its_path_alone() -> None:
    """A URI of SQLite's own could name one that nobody here finds, or memory."""
    for url in ("sqlite:///file:/srv/x.db?uri=true", "sqlite:///file:x?mode=memory&uri=true", "sqlite://"):
        with pytest.raises(InvalidUrl, match="allowed: a path"):
            Database(url)


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


def test_the_log_of_a_file_that_was_replaced_is_kept_by_one_connection(tmp_path: Path) -> None:
    """However often is looked for the file: each look would take descriptors otherwise, until there are none."""
    path = tmp_path / "stiction.sqlite3"
    with closing(Database(f"sqlite:///{path}")) as database:
        upgrade(database)
        database.checkpoint()
        shutil.copyfile(path, tmp_path / "older")
        look(database)
        database.checkpoint()
        look(database)
        shutil.copyfile(tmp_path / "older", path)
        opened = []
        for _ in range(3):
            with pytest.raises(StorageUnavailable, match="deleted or replaced"):
                look(database)
            opened.append(sum(str(tmp_path) in os.path.realpath(each) for each in Path("/proc/self/fd").iterdir()))
    assert opened[0] == opened[1] == opened[2]


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
    """What the system says of locks held on the file and on the index of its write-ahead log."""
    inodes = {Path(f"{path}{suffix}").stat().st_ino for suffix in ("", "-shm")}
    lines = Path("/proc/locks").read_text(encoding="ascii").splitlines()
    held = [line for line in lines if " -> " not in line]  # who waits for a lock is marked by an arrow
    return {line.split(":", 1)[1] for line in held if int(line.split()[5].rsplit(":", 1)[1]) in inodes}


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


@pytest.mark.parametrize("size", [0, 1])
def test_beside_a_log_without_a_byte_a_database_is_made(tmp_path: Path, size: int) -> None:
    path = tmp_path / "stiction.sqlite3"
    Path(f"{path}-wal").write_bytes(bytes(size))
    if size:
        with pytest.raises(StorageUnavailable, match="is not there, and its"):
            SqliteFile(str(path))._is_there()
    else:
        assert not SqliteFile(str(path))._is_there()


def test_a_checkpoint_brings_what_was_written_into_the_file(tmp_path: Path) -> None:
    path = tmp_path / "stiction.sqlite3"
    with closing(Database(f"sqlite:///{path}")) as database:
        upgrade(database)
        database.checkpoint()
        before = path.read_bytes()
        with database.write() as session:
            session.connection().exec_driver_sql("CREATE TABLE more (something)")
        assert path.read_bytes() == before
        database.checkpoint()
        assert b"CREATE TABLE more" in path.read_bytes()
