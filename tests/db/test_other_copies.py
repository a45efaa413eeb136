"""Files that were put in the place of a database beside the write-ahead log of another one, as a kill leaves it."""

import random
import sqlite3
import struct
import subprocess
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing, contextmanager
from pathlib import Path

import pytest

from db.backup import backup
from db.blobs import BlobStore
from db.database import Database
from db.errors import StorageUnavailable
from db.migrate import upgrade
from db.write_ahead_log import headers
from tests import forking
from tests.db.looks import header_of, look

pytestmark = pytest.mark.usefixtures("without_pauses")
NAME = "stiction.sqlite3"


def opened(path: Path) -> Database:
    path.parent.mkdir(exist_ok=True)
    database = Database(f"sqlite:///{path}")
    upgrade(database)
    return database


def copy(path: Path, target: Path) -> Path:
    """By another process: closing a file here would end SQLite's locks."""
    target.parent.mkdir(exist_ok=True)
    subprocess.run(["cp", str(path), str(target)], check=True)
    return target


def killed(path: Path) -> Path:
    """What a kill leaves now: file and log."""
    left = path.parent / "left" / NAME
    copy(Path(f"{path}-wal"), Path(f"{left}-wal"))
    return copy(path, left)


@contextmanager
def reading(path: Path) -> Iterator[None]:
    with closing(sqlite3.connect(path, isolation_level=None)) as connection:
        connection.execute("BEGIN")
        connection.execute("SELECT count(*) FROM store").fetchone()
        yield


def older(path: Path) -> tuple[Path, Path]:
    with closing(opened(path)) as database:
        other = copy(path, path.parent / "other")
        look(database, 2)
        database.empty_log()
        look(database)
        return other, killed(path)


def before_vacuum(path: Path) -> tuple[Path, Path]:
    """It changes nothing of what our transactions write into the header."""
    with closing(opened(path)) as database:
        look(database)
        database.empty_log()
        other = copy(path, path.parent / "other")
        with closing(sqlite3.connect(path)) as operator:
            operator.execute("VACUUM")
        database.empty_log()
        look(database)
        return other, killed(path)


def before_migration(path: Path) -> tuple[Path, Path]:
    with closing(Database(f"sqlite:///{path}")) as database:
        upgrade(database, "0019")
        database.empty_log()
        other = copy(path, path.parent / "other")
        upgrade(database)
        database.empty_log()
        look(database)
        return other, killed(path)


def newer(path: Path) -> tuple[Path, Path]:
    """The service went on elsewhere, and its file came back to where it had been killed."""
    with closing(opened(path)) as database:
        database.empty_log()
        look(database)
        left = killed(path)
        look(database, 2)
        database.empty_log()
        return copy(path, path.parent / "other"), left


def of_another_store(path: Path, looks: int) -> tuple[Path, Path]:
    with closing(opened(path.parent / "another" / NAME)) as another:
        look(another, looks)
        another.empty_log()
        other = copy(path.parent / "another" / NAME, path.parent / "other")
    with closing(opened(path)) as database:
        database.empty_log()
        look(database, 5)
        return other, killed(path)


def of_another_store_with_a_lower_count(path: Path) -> tuple[Path, Path]:
    return of_another_store(path, 1)


def of_another_store_with_a_higher_count(path: Path) -> tuple[Path, Path]:
    return of_another_store(path, 9)


def of_a_backup(path: Path) -> tuple[Path, Path]:
    with closing(opened(path)) as database:
        backup(database, BlobStore(path.parent / "blobs"), path.parent / "backup", lambda *_: None)
        database.empty_log()
        look(database)
        return copy(path.parent / "backup" / NAME, path.parent / "other"), killed(path)


@pytest.fixture
def same_marks(monkeypatch: pytest.MonkeyPatch) -> None:
    """Marks and checksums of 16 bits take one foreign log in 33,000 for the file's own: not in one of many runs."""
    monkeypatch.setattr("db.file_header._RANDOM", random.Random(1))


@pytest.mark.usefixtures("same_marks")
@pytest.mark.parametrize(
    "scene",
    [
        older,
        before_vacuum,
        before_migration,
        newer,
        of_another_store_with_a_lower_count,
        of_another_store_with_a_higher_count,
        of_a_backup,
    ],
)
def test_no_other_copy_is_mixed_with_the_log(tmp_path: Path, scene: Callable[[Path], tuple[Path, Path]]) -> None:
    other, left = scene(tmp_path / NAME)
    content = other.read_bytes()
    log = Path(f"{left}-wal").read_bytes()
    with closing(Database(f"sqlite:///{left}")) as database:  # what was left goes on
        database.ping()
        database.check_pages()
    left.write_bytes(content)
    Path(f"{left}-wal").write_bytes(log)
    for _ in range(2):
        named = pytest.raises(StorageUnavailable, match=r"another copy was put in its place.*move away -wal and -shm")
        with closing(Database(f"sqlite:///{left}")) as database, named:
            database.ping()
        assert (left.read_bytes() == content, Path(f"{left}-wal").read_bytes() == log) == (True, True)
    Path(f"{left}-wal").unlink()
    with closing(Database(f"sqlite:///{left}")) as database:
        upgrade(database)
        look(database)
        database.check_pages()


@pytest.mark.parametrize("looks", [1, 9], ids=["with a lower count", "with a higher count"])
def test_another_file_under_a_running_process_is_noticed_before_the_next_write(tmp_path: Path, looks: int) -> None:
    path = tmp_path / NAME
    with closing(opened(tmp_path / "another" / NAME)) as another:
        look(another, looks)
        another.empty_log()
    other = copy(tmp_path / "another" / NAME, tmp_path / "other").read_bytes()
    with closing(opened(path)) as database:
        database.empty_log()
        look(database, 3)
        copy(tmp_path / "other", path)
        with pytest.raises(StorageUnavailable, match="deleted or replaced"):
            look(database)
    assert path.read_bytes() == other  # nothing of the log at the end, either


def test_a_file_at_any_stage_belongs_to_the_log(tmp_path: Path) -> None:
    """A reader of all that was written lets a checkpoint bring it into the file, but nobody begin the log anew."""
    path = tmp_path / NAME
    with closing(opened(path)) as database, ExitStack() as reader:
        look(database)
        database.empty_log()
        stages = [copy(path, tmp_path / "stage")]
        for number in range(3):
            look(database)
            with reader.pop_all():
                reader.enter_context(reading(path))
            database.checkpoint()
            stages.append(copy(path, tmp_path / f"stage{number}"))
        log = copy(Path(f"{path}-wal"), tmp_path / "log")
    assert len(headers(log)) == 3
    assert [headers(log)[0].follows(header_of(stages[0])), *map(header_of, stages[1:])] == [True, *headers(log)]
    for stage in stages:
        copy(log, Path(f"{stage}-wal"))
        with closing(Database(f"sqlite:///{stage}")) as database:
            database.ping()
            database.check_pages()


def test_the_log_of_an_older_version_which_only_counted_is_taken(tmp_path: Path) -> None:
    path = tmp_path / NAME
    with closing(opened(path)) as database, closing(sqlite3.connect(path, isolation_level=None)) as before:
        before.execute("PRAGMA application_id = 0")
        database.empty_log()
        for count in range(7, 10):
            before.execute(f"PRAGMA user_version = {count}")
        left = killed(path)
    with closing(Database(f"sqlite:///{left}")) as database:
        look(database)
        database.check_pages()


def test_a_first_frame_whose_page_was_not_written_yet_tells_nothing(tmp_path: Path) -> None:
    """Its place has the page of an earlier log, or what a power cut left."""
    path = tmp_path / NAME
    with closing(opened(path)) as database:
        database.empty_log()
        look(database)
        log = copy(Path(f"{path}-wal"), tmp_path / "log")
    assert len(headers(log)) == 1
    content = bytearray(log.read_bytes())
    content[32 + 24 + 4000] ^= 1
    log.write_bytes(content)
    assert headers(log) == []


def test_a_first_header_behind_other_frames_is_none_until_its_page_was_written(tmp_path: Path) -> None:
    """Behind what another program changed, or in a transaction larger than SQLite's cache, which writes that first."""
    path = tmp_path / NAME
    with closing(opened(path)) as database, closing(sqlite3.connect(path, isolation_level=None)) as other:
        database.empty_log()
        other.execute("UPDATE alembic_version SET version_num = version_num")
        look(database)
        log = copy(Path(f"{path}-wal"), tmp_path / "log")
        in_file = header_of(path)
    content = bytearray(log.read_bytes())
    pages = [struct.unpack(">I", content[at : at + 4])[0] for at in range(32, len(content), 4096 + 24)]
    assert pages.index(1) > 0
    assert [header.follows(in_file) for header in headers(log)] == [True]
    content[32 + pages.index(1) * (4096 + 24) + 24 + 4000] ^= 1
    log.write_bytes(content)
    assert headers(log) == []


HAMMER = """
import random, sys
from contextlib import closing
from db.database import Database
from db.repositories import stores

sys.stderr = open(f"{path}-errors-{seed}", "w", buffering=1)
draw = random.Random(seed)
for _ in range(4):
    with closing(Database("sqlite:///" + path)) as database:
        for _ in range(60):
            with database.write(durable=False) as session:
                stores.touch(session)
                if draw.random() < 0.2:
                    session.connection().exec_driver_sql("CREATE TABLE IF NOT EXISTS more AS SELECT randomblob(50000)")
                    session.connection().exec_driver_sql("DROP TABLE more")
            if draw.random() < 0.5:
                mode = draw.choice(["PASSIVE", "RESTART", "TRUNCATE", "FULL"])
                with database.connect() as connection:
                    connection.exec_driver_sql(f"PRAGMA wal_checkpoint({mode})")
            database.ping()
"""


def test_processes_that_work_on_one_file_find_no_fault_with_each_other(tmp_path: Path) -> None:
    """However they write, begin the log anew, open and close."""
    path = tmp_path / NAME
    opened(path).close()
    codes = forking.exit_codes(*((exec, HAMMER, {"path": str(path), "seed": seed}) for seed in range(3)))
    errors = [Path(f"{path}-errors-{seed}").read_text() for seed in range(3)]
    assert (codes, errors) == ([0] * 3, [""] * 3)


def test_a_log_that_ends_in_the_middle_of_a_frame_is_read_up_to_there(tmp_path: Path) -> None:
    path = tmp_path / NAME
    with closing(opened(path)) as database:
        database.empty_log()
        look(database, 2)
        log = copy(Path(f"{path}-wal"), tmp_path / "log")
    whole = log.read_bytes()
    size = struct.unpack(">8xI", whole[:12])[0]
    assert len(headers(log)) == 2
    for kept in (32, 32 + 23, 32 + 24 + 71, 32 + 24 + size - 1):
        log.write_bytes(whole[:kept])
        assert headers(log) == []
