"""Copies of all that a service keeps: a folder with the rows as a SQLite file and the blobs beside it.

The same from either database and into either, so that a backup is the way from SQLite to PostgreSQL, too.
"""

import fcntl
import logging
import os
import shutil
from collections.abc import Callable, Container, Iterable, Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

from sqlalchemy import URL, Table, func, insert, inspect, select, text, update
from sqlalchemy.exc import IntegrityError
from sqlalchemy.orm import Session

from db import identity, migrate
from db.blobs import BlobStore, disk_errors_named
from db.database import Database
from db.errors import BlobDamaged, DatabaseError, NotEmpty, NotFound
from db.quarantine import sync_folder
from db.records import Actor
from db.repositories import audit, stores
from db.sqlite_file import SIDE_FILES
from db.tables import Base, BrowserSessionRow, IdempotencyKeyRow, RunnerRow, StoreRow

logger = logging.getLogger(__name__)

FILE = "stiction.sqlite3"
LACKING = "lacking.txt"
"""In a backup's folder where it lacks blobs that were missing or damaged: their hashes, a line each."""
LEFT_OUT = {table.__tablename__ for table in (RunnerRow, BrowserSessionRow, IdempotencyKeyRow, StoreRow)}
"""Tables of what is not copied: running processes, sessions, answers to repeated requests, and the store id: what is
restored is a store of its own, so that two that grow apart are never taken for one."""

ROWS_AT_ONCE = 500

ATTEMPTS = 3
"""How often rows are copied where files that they refer to are deleted meanwhile, as old uploads are."""

Report = Callable[[str, int], None]
"""What is given the kind of what was copied, and how many of it."""


def backup(database: Database, blobs: BlobStore, folder: Path, report: Report) -> list[str]:
    """Copy everything into a folder, as of one moment of the database; blobs that are there already are kept.

    Blobs that are missing or damaged are left out, and listed in the folder for ``restore``; returns what is wrong with
    each. May run beside the service. Running jobs are copied as queued ones. Raises ``SchemaMismatch``, ``NotEmpty`` if
    the folder has another backup, is getting one, or is the store's own, and ``StorageUnavailable`` on a full disk.
    """
    migrate.check(database)
    if blobs.has_within(folder):
        raise NotEmpty(str(blobs), "a folder outside of it")
    folder.mkdir(parents=True, exist_ok=True)
    file = folder / FILE
    unfinished = file.with_suffix(".part")
    with _alone_in(folder):
        if file.exists():
            raise NotEmpty(f"backup {file}", "a folder without one; blobs of an earlier backup may be in it")
        for _ in range(ATTEMPTS):
            left_out = _copy_out(database, blobs, unfinished, report)
            if not any(isinstance(error, NotFound) for error in left_out.values()):
                break
        _list_lacking(folder, left_out)
        unfinished.replace(file)
        sync_folder(folder)
    return [str(error) for error in left_out.values()]


def _list_lacking(folder: Path, hashes: Iterable[str]) -> None:
    """Durably, and only where there are any: an earlier backup in the folder may have lacked others."""
    file = folder / LACKING
    file.unlink(missing_ok=True)
    if lines := "".join(f"{sha256}\n" for sha256 in hashes):
        with disk_errors_named(), file.open("w", encoding="ascii") as stream:
            stream.write(lines)
            stream.flush()
            os.fsync(stream.fileno())


def _lacking(folder: Path) -> set[str]:
    file = folder / LACKING
    return set(file.read_text("ascii").split()) if file.is_file() else set()


def _copy_out(database: Database, blobs: BlobStore, unfinished: Path, report: Report) -> dict[str, DatabaseError]:
    for left in (unfinished, *(Path(f"{unfinished}{suffix}") for suffix in SIDE_FILES)):
        left.unlink(missing_ok=True)
    with closing(_opened(unfinished)) as copy:
        migrate.upgrade(copy)
        _copy_rows(database, copy, report)
        target = BlobStore(unfinished.parent)
        target.clear_spool()  # of a backup that was killed
        left_out = _copy_blobs(copy, blobs, target, report)
        copy.empty_log()
    return left_out


@contextmanager
def _alone_in(folder: Path) -> Iterator[None]:
    """Let no second backup begin in the folder; the lock goes with the process."""
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            raise NotEmpty(f"a backup under way in {folder}", "one at a time") from error
        except OSError as error:
            logger.warning("a second backup in %s would not be noticed: %s", folder, error)  # by its file system
        yield
    finally:
        os.close(descriptor)


def restore(
    folder: Path, database: Database, blobs: BlobStore, report: Report, *, taken_over_by: Actor | None = None
) -> list[str]:
    """Fill an empty database and blob store from a backup; they become a store of their own, with an id of its own.

    One that an older version made is brought to today's schema on the way. Every blob must have the bytes that it is
    named for. Those that the backup itself left out, and nobody has put into
    it since, are missing afterwards; returns what is said of each. A blob store of another database is only filled
    where it is ``taken_over_by`` somebody, as the audit trail then records; that database is refused there from then
    on. Raises ``NotEmpty`` for a database that has any rows and for a store that has the backup's blobs or is inside
    the backup, ``StoreMismatch``, ``SchemaMismatch``, ``NotFound`` for a blob that is missing: all before anything is
    changed. ``BlobDamaged``, for a blob whose bytes have changed, and ``NotEmpty`` for a database that somebody else
    fills meanwhile, leave tables without these rows and the blobs before it, and the same restore can be begun again.
    """
    file = folder / FILE
    if not file.is_file():
        raise FileNotFoundError(f"backup {file} is not there")
    if blobs.has_within(folder) or blobs.is_within(folder):  # the only copy would be worked in from now on
        raise NotEmpty(str(blobs), "a data folder other than the backup's and outside of it")
    source = BlobStore(folder)
    with TemporaryDirectory() as own, closing(_opened(_copied(file, Path(own)))) as copy:
        if migrate.current(copy) is not None:
            migrate.upgrade(copy)  # ours alone: the backup stays of the version that made it
        migrate.check(copy)
        _require_blobs(copy, source, blobs, _lacking(folder))
        _refuse_rows(database)
        if taken_over_by is None:
            identity.check_to_fill(database, blobs)
        migrate.upgrade(database)
        if taken_over_by is None:
            identity.join(database, blobs, alone=True, to_fill=True)
        else:
            identity.adopt(database, blobs, None)
        left_out = _copy_blobs(copy, source, blobs, report, _lacking(folder))
        _copy_rows(copy, database, report, taken_over_by)
    return [str(error) for error in left_out.values()]


def damaged(database: Database, blobs: BlobStore, *, deep: bool) -> Iterator[str]:
    """What is wrong with the blobs that rows refer to, a line each: missing, or (``deep``) not the bytes of before."""
    present = set(blobs.hashes())
    with database.read() as session:
        for sha256 in identity.wanted(session):
            try:
                if deep:
                    blobs.path(sha256)
                elif sha256 not in present:
                    blobs.locate(sha256)  # it may be in quarantine
            except NotFound:
                yield f"blob {sha256} is missing"
            except BlobDamaged as error:
                yield str(error)


def _copied(file: Path, folder: Path) -> Path:
    """To open a SQLite file is to write to its folder, and a backup may be read-only."""
    return Path(shutil.copyfile(file, folder / FILE))


def _opened(file: Path) -> Database:
    return Database(URL.create("sqlite", database=str(file)))  # a URL in text would read ? and % as its own


def _refuse_rows(database: Database) -> None:
    """Of any older schema, or of none; a file that is not there is not made."""
    if not database.is_missing:
        with database.read() as session:
            _refuse_rows_in(session)


def _refuse_rows_in(session: Session) -> None:
    there = inspect(session.connection()).get_table_names()
    for table in Base.metadata.sorted_tables:
        if table.name in LEFT_OUT or table.name not in there:
            continue
        if count := session.scalar(select(func.count()).select_from(table)):
            raise NotEmpty(f"table {table.name} ({count} rows)", "an empty database")


def _copy_rows(source: Database, target: Database, report: Report, taken_over_by: Actor | None = None) -> None:
    copied: dict[str, int] = {}
    with source.read() as reading, _alone_filling(target) as writing:
        for table in Base.metadata.sorted_tables:
            if table.name not in LEFT_OUT:
                copied[table.name] = _copy_table(table, reading, writing)
                report(table.name, copied[table.name])
        if taken_over_by is not None:  # behind the entries of the backup
            audit.add(writing, taken_over_by, "store.taken_over", stores.find_id(writing) or "", {"rows": copied})


@contextmanager
def _alone_filling(database: Database) -> Iterator[Session]:
    """A transaction that fills an empty database; raises ``NotEmpty`` where another has done so since it was seen."""
    try:
        with database.write() as session:
            _refuse_rows_in(session)
            yield session
    except IntegrityError as error:  # PostgreSQL has two writers at once, the rows of the first meet those of the other
        raise NotEmpty("rows that somebody else has just stored", "an empty database") from error


def _copy_table(table: Table, reading: Session, writing: Session) -> int:
    rows = reading.execute(select(table).execution_options(yield_per=ROWS_AT_ONCE)).mappings()
    keys = table.primary_key.columns.values()
    inward = [column for column in table.columns if any(key.column.table is table for key in column.foreign_keys)]
    count = 0
    for part in rows.partitions():
        settled = [_settled(table, dict(row)) for row in part]
        writing.execute(insert(table), [row | {column.name: None for column in inward} for row in settled])
        count += len(part)
    for column in inward:  # rows that refer to others of their table do so once all are there
        for row in reading.execute(select(table).where(column.is_not(None))).mappings():
            own = [key == row[key.name] for key in keys]
            writing.execute(update(table).where(*own).values({column.name: row[column.name]}))
    if count and len(keys) == 1 and keys[0].type.python_type is int and _is_postgresql(writing):
        place = f"pg_get_serial_sequence('{table.name}', '{keys[0].name}')"
        writing.execute(text(f"SELECT setval({place}, (SELECT max({keys[0].name}) FROM {table.name}))"))
    return count


def _settled(table: Table, row: dict[str, object]) -> dict[str, object]:
    """The row as it is without runners."""
    if table.name == "jobs" and row["status"] == "running":
        return row | {"status": "queued", "runner_id": None}
    return row


def _is_postgresql(session: Session) -> bool:
    return session.connection().dialect.name == "postgresql"


def _require_blobs(rows: Database, source: BlobStore, target: BlobStore, lacking: set[str]) -> None:
    """That all that the rows refer to is in one of the two, but for what the source is known to lack."""
    present = {*source.hashes(), *target.hashes(), *lacking}
    with rows.read() as session:
        for sha256 in identity.wanted(session):
            if sha256 not in present:
                source.locate(sha256)


def _copy_blobs(
    rows: Database, source: BlobStore, target: BlobStore, report: Report, may_lack: Container[str] | None = None
) -> dict[str, DatabaseError]:
    """Those that the rows refer to and the target has not; rows never refer to a blob that is not stored.

    Returns what is wrong with those that are missing or damaged; raises it of others than ``may_lack`` (None: all may).
    """
    present, count, left_out = set(target.hashes()), 0, dict[str, DatabaseError]()
    with rows.read() as session:
        for sha256 in identity.wanted(session):
            if sha256 in present:
                continue
            try:
                target.take(source.locate(sha256), sha256)
            except (NotFound, BlobDamaged) as error:
                if may_lack is not None and sha256 not in may_lack:
                    raise
                left_out[sha256] = error
            else:
                count += 1
                report("blobs", count)
    report("blobs", count)
    return left_out
