"""The database behind any SQLAlchemy URL: one engine, one transaction a unit of work."""

import json
import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any, cast

from sqlalchemy import URL, Connection, Engine, create_engine, event, make_url
from sqlalchemy.engine.interfaces import DBAPIConnection
from sqlalchemy.exc import (
    ArgumentError,
    DatabaseError,
    DBAPIError,
    InterfaceError,
    NoSuchModuleError,
    OperationalError,
)
from sqlalchemy.exc import TimeoutError as PoolTimeout
from sqlalchemy.orm import Session

from db.defaults import (
    CONNECT_TIMEOUT,
    IDLE_TRANSACTION_TIMEOUT,
    LOCK_TIMEOUT,
    POOL_SIZE,
    POSTGRESQL_POOL_OVERFLOW,
    SQLITE_POOL_OVERFLOW,
    SQLITE_SYNCHRONOUS,
)
from db.errors import DriverMissing, InvalidUrl, StorageUnavailable
from db.file_header import renew
from db.sqlite_file import SqliteFile

_BEGIN = "sqlite_begin"
_DURABLE = "durable"
SCHEMES = ("sqlite", "postgresql")
"""Of the databases that are known."""
_READ_ONLY = "25006"
"""SQLSTATE of a PostgreSQL that takes no writes: a standby that has not been promoted yet."""


class Database:
    """An engine with the two kinds of transaction that the rest of the code uses.

    ``url`` is any SQLAlchemy URL. SQLite, embedded, gets write-ahead logging and foreign keys, and has one writer at a
    time; PostgreSQL has many, which wait for each other only where they lock the same row. A writer waits
    ``lock_timeout`` seconds at most. Raises ``InvalidUrl``, ``DriverMissing`` for a URL whose driver is not installed,
    and ``StorageUnavailable`` wherever the database cannot be reached or is full.
    """

    def __init__(self, url: str | URL, lock_timeout: float = LOCK_TIMEOUT) -> None:
        self.url = url if isinstance(url, str) else url.render_as_string(hide_password=False)
        self.engine = _engine(_parsed(url))
        # a deferred transaction that reads first cannot always be upgraded to writing: take the write lock at once
        self._writing = self.engine.execution_options(**{_BEGIN: "BEGIN IMMEDIATE"})
        self._noting = self._writing.execution_options(**{_DURABLE: False})
        self._reading = self.engine
        self._is_closed = False
        self._file = SqliteFile(self.engine.url.database if self.is_sqlite else None)
        self.store_id: str | None = None  # that of the blob store that it works with, once somebody has compared them
        if self.is_sqlite:
            _prepare_sqlite(self.engine, lock_timeout, self._file)
        if self.engine.dialect.name == "postgresql":
            _prepare_postgresql(self.engine, lock_timeout)
            # by default each statement would see what was committed meanwhile
            self._reading = self.engine.execution_options(isolation_level="REPEATABLE READ")

    def __str__(self) -> str:
        return f"database {self.engine.url.render_as_string(hide_password=True)}"

    @property
    def is_sqlite(self) -> bool:
        """Whether this is the embedded database."""
        return self.engine.dialect.name == "sqlite"

    @property
    def disk(self) -> Path | None:
        """The folder of the embedded database's file; None of another database."""
        file = self.engine.url.database if self.is_sqlite else None
        return None if file is None else Path(file).resolve().parent

    @property
    def is_missing(self) -> bool:
        """Whether there is no file of the embedded database; whoever opens it makes an empty one."""
        return self.is_sqlite and not Path(self.engine.url.database or "").is_file()

    @contextmanager
    def connect(self, *, to_write: bool = False) -> Iterator[Connection]:
        """A connection below the transactions of the stores: for migrations, whose errors show the URL too.

        One that is opened ``to_write`` takes SQLite's write lock with each transaction, and renews the file's header.
        """
        engine = self._writing if to_write else self.engine
        with _unavailable_named(str(self)), engine.connect() as connection:
            yield connection

    @contextmanager
    def read(self) -> Iterator[Session]:
        """One consistent view; whatever is changed in it is rolled back."""
        with _unavailable_named(), Session(self._reading) as session:
            yield session

    @contextmanager
    def write(self, *, durable: bool = True) -> Iterator[Session]:
        """One transaction: committed as a whole at the end, rolled back as a whole on any exception.

        Other processes see it at once either way; one that is not ``durable`` may be forgotten in a power cut, unless a
        durable one followed, and waits for no disk.
        """
        engine = self._writing if durable else self._noting
        with _unavailable_named(), Session(engine) as session, session.begin():
            connection = session.connection()  # SQLite waits for the write lock here, not at the first statement
            if not durable and connection.dialect.name == "postgresql":
                connection.exec_driver_sql("SET LOCAL synchronous_commit = off")
            yield session
        self._file.require()  # a commit into a file that was deleted meanwhile is none

    def ping(self) -> None:
        """Make sure that the database answers and has its tables; raises ``StorageUnavailable``."""
        with self.read() as session:
            session.connection().exec_driver_sql("SELECT version_num FROM alembic_version")
        with sqlite_errors_named():
            self._file.check_head()

    def checkpoint(self) -> None:
        """Bring what SQLite's write-ahead log holds into the file, which then shows its generation."""
        if self.is_sqlite:
            with self.connect() as connection:
                connection.exec_driver_sql("PRAGMA wal_checkpoint(PASSIVE)")
            self._file.require()

    def empty_log(self) -> None:
        """Bring all of an SQLite database's write-ahead log into its file, which is whole then without those beside it.

        Closing does so, too, but says nothing where the disk is full. Raises ``StorageUnavailable``.
        """
        with self.connect() as connection:
            is_busy, *_ = connection.exec_driver_sql("PRAGMA wal_checkpoint(TRUNCATE)").one()
        self._file.require()
        if is_busy:
            raise StorageUnavailable(f"{self} is open elsewhere; allowed: one process alone")

    def check_pages(self) -> None:
        """Read the whole of an SQLite file; raises ``StorageUnavailable`` where it is damaged."""
        with sqlite_errors_named():
            self._file.check_pages()

    def close(self) -> None:
        """Close every connection; one that a thread still has is closed once it gives it back."""
        self._file.check_before_close()
        if not self._is_closed:  # nobody else would: the pool that gets it back is no longer this engine's
            self._is_closed = True
            event.listen(self.engine, "checkin", lambda _, record: record.invalidate())
        self.engine.dispose()


@contextmanager
def sqlite_errors_named() -> Iterator[None]:
    """Raise ``StorageUnavailable`` for what SQLite itself says below SQLAlchemy."""
    try:
        yield
    except sqlite3.Error as error:
        raise StorageUnavailable(f"database: {error}") from error


@contextmanager
def _unavailable_named(name: str = "database") -> Iterator[None]:
    try:
        yield
    except (DBAPIError, PoolTimeout) as error:
        if isinstance(error, DBAPIError) and not _says_unavailable(error):
            raise
        cause = str(error.orig if isinstance(error, DBAPIError) else error).partition("\nDETAIL:")[0]
        raise StorageUnavailable(f"{name}: {cause}") from error


def _says_unavailable(error: DBAPIError) -> bool:
    """Whether the database itself is at fault; SQLite says so of a damaged file by the base class alone."""
    if isinstance(error, OperationalError | InterfaceError) or type(error) is DatabaseError:
        return True
    return getattr(error.orig, "sqlstate", None) == _READ_ONLY


def _parsed(url: str | URL) -> URL:
    """The URL in its parts, none of which an error repeats, for one may be a password."""
    try:
        return make_url(url)
    except (ArgumentError, ValueError) as error:
        allowed = "such as sqlite:////var/lib/stiction/stiction.sqlite3 or postgresql://user:password@host/database"
        raise InvalidUrl(f"database URL is no SQLAlchemy URL; allowed: {allowed}") from error


def _engine(url: URL) -> Engine:
    if url.get_backend_name() == "sqlite" and (url.database or ":memory:").startswith(("file:", ":memory:")):
        allowed = "a path, such as sqlite:////var/lib/stiction/stiction.sqlite3"
        found = f"{url.database or 'nothing'}, not a file by its path"
        raise InvalidUrl(f"database URL of SQLite names {found}; allowed: {allowed}")
    allowed = " or ".join(f"{scheme}://" for scheme in SCHEMES)
    if url.get_backend_name() not in SCHEMES:
        raise InvalidUrl(f"database URL begins with {url.drivername}://; allowed: {allowed}")
    if "@" in (url.host or ""):  # what follows the first one would be told to everybody as a host that is not found
        raise InvalidUrl("database URL has an @ in its user or password; allowed: %40")
    options: dict[str, Any] = {"pool_size": POOL_SIZE, "max_overflow": SQLITE_POOL_OVERFLOW}
    if url.get_backend_name() != "sqlite":  # a server may have restarted since a connection was last used
        options |= {"max_overflow": POSTGRESQL_POOL_OVERFLOW, "pool_pre_ping": True}
    if url.get_backend_name() == "postgresql":
        options["connect_args"] = {"connect_timeout": url.query.get("connect_timeout", CONNECT_TIMEOUT)}
    options["json_serializer"] = partial(json.dumps, allow_nan=False)  # SQLite would take NaN, PostgreSQL would not
    try:
        return create_engine(url, hide_parameters=True, **options)  # errors are logged; what callers sent is not
    except ModuleNotFoundError as error:
        raise DriverMissing(url.render_as_string(hide_password=True), error.name or str(error)) from error
    except NoSuchModuleError as error:
        raise InvalidUrl(f"database URL begins with {url.drivername}://; allowed: {allowed}") from error


def _prepare_postgresql(engine: Engine, lock_timeout: float) -> None:
    @event.listens_for(engine, "connect")
    def set_timeouts(connection: DBAPIConnection, _record: object) -> None:
        cursor = connection.cursor()
        cursor.execute(f"SET lock_timeout = {round(lock_timeout * 1000)}")
        cursor.execute(f"SET idle_in_transaction_session_timeout = {round(IDLE_TRANSACTION_TIMEOUT * 1000)}")
        cursor.close()
        connection.commit()


def _prepare_sqlite(engine: Engine, busy_timeout: float, file: SqliteFile) -> None:
    @event.listens_for(engine, "do_connect")
    def refuse_another(*_: object) -> None:
        file.require()  # where it is gone, SQLite would make an empty one

    @event.listens_for(engine, "connect")
    def set_pragmas(connection: sqlite3.Connection, _record: object) -> None:
        connection.isolation_level = None  # Python's own BEGIN comes late and skips SELECT and DDL; ours does not
        for pragma in (
            f"busy_timeout = {round(busy_timeout * 1000)}",
            "journal_mode = WAL",
            "foreign_keys = ON",
        ):
            connection.execute(f"PRAGMA {pragma}")
        connection.execute("SELECT count(*) FROM sqlite_master")  # from now on the files beside it stay, too
        file.note_opened(connection)

    @event.listens_for(engine, "close")
    def note_closing(connection: DBAPIConnection, _record: object) -> None:
        file.note_closing(connection)

    @event.listens_for(engine, "begin")
    def begin(connection: Connection) -> None:
        file.require()
        options = connection.get_execution_options()
        synchronous = SQLITE_SYNCHRONOUS if options.get(_DURABLE, True) else "NORMAL"
        connection.exec_driver_sql(f"PRAGMA synchronous = {synchronous}")  # inside a transaction it would do nothing
        connection.exec_driver_sql(options.get(_BEGIN, "BEGIN"))
        if _BEGIN in options:  # each commit brings the header along, by which file and log are told to belong together
            renew(cast(sqlite3.Connection, connection.connection.driver_connection))
