"""The database behind any SQLAlchemy URL: one engine, one transaction a unit of work."""

import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager

from sqlalchemy import Connection, Engine, create_engine, event, make_url
from sqlalchemy.exc import DatabaseError, DBAPIError, InterfaceError, OperationalError
from sqlalchemy.exc import TimeoutError as PoolTimeout
from sqlalchemy.orm import Session

from db.defaults import POOL_OVERFLOW, POOL_SIZE, SQLITE_BUSY_TIMEOUT, SQLITE_SYNCHRONOUS
from db.errors import StorageUnavailable

_BEGIN = "sqlite_begin"


class Database:
    """An engine with the two kinds of transaction that the rest of the code uses.

    ``url`` is any SQLAlchemy URL; SQLite gets write-ahead logging, foreign keys and a busy timeout of
    ``busy_timeout`` seconds. Raises ``StorageUnavailable`` wherever the database cannot be reached or is full.
    """

    def __init__(self, url: str, busy_timeout: float = SQLITE_BUSY_TIMEOUT) -> None:
        self.url = url
        self.engine = create_engine(url, pool_size=POOL_SIZE, max_overflow=POOL_OVERFLOW, pool_pre_ping=not _local(url))
        if self.is_sqlite:
            _prepare_sqlite(self.engine, busy_timeout)
        # a deferred transaction that reads first cannot always be upgraded to writing: take the write lock at once
        self._writing = self.engine.execution_options(**{_BEGIN: "BEGIN IMMEDIATE"})

    @property
    def is_sqlite(self) -> bool:
        """Whether this is the embedded database."""
        return self.engine.dialect.name == "sqlite"

    @contextmanager
    def connect(self) -> Iterator[Connection]:
        """A connection below the transactions of the stores: for migrations, whose errors tell the URL too."""
        shown = self.engine.url.render_as_string(hide_password=True)
        with _unavailable_named(f"database {shown}"), self.engine.connect() as connection:
            yield connection

    @contextmanager
    def read(self) -> Iterator[Session]:
        """One consistent view; whatever is changed in it is rolled back."""
        with _unavailable_named(), Session(self.engine) as session:
            yield session

    @contextmanager
    def write(self) -> Iterator[Session]:
        """One transaction: committed as a whole at the end, rolled back as a whole on any exception."""
        with _unavailable_named(), Session(self._writing) as session, session.begin():
            session.connection()  # waits for the write lock here, not at the first statement
            yield session

    def ping(self) -> None:
        """Make sure that the database answers; raises ``StorageUnavailable``."""
        with self.read() as session:
            session.connection().exec_driver_sql("SELECT 1")

    def close(self) -> None:
        """Close every connection."""
        self.engine.dispose()


@contextmanager
def _unavailable_named(name: str = "database") -> Iterator[None]:
    try:
        yield
    except (DBAPIError, PoolTimeout) as error:
        if isinstance(error, DBAPIError) and not _says_unavailable(error):
            raise
        cause = error.orig if isinstance(error, DBAPIError) else error
        raise StorageUnavailable(f"{name}: {cause}") from error


def _says_unavailable(error: DBAPIError) -> bool:
    """Whether the database itself is at fault; SQLite says so of a damaged file by the base class alone."""
    return isinstance(error, OperationalError | InterfaceError) or type(error) is DatabaseError


def _local(url: str) -> bool:
    return make_url(url).get_backend_name() == "sqlite"


def _prepare_sqlite(engine: Engine, busy_timeout: float) -> None:
    @event.listens_for(engine, "connect")
    def set_pragmas(connection: sqlite3.Connection, _record: object) -> None:
        connection.isolation_level = None  # Python's own BEGIN comes late and skips SELECT and DDL; ours does not
        for pragma in (
            f"busy_timeout = {round(busy_timeout * 1000)}",
            "journal_mode = WAL",
            f"synchronous = {SQLITE_SYNCHRONOUS}",
            "foreign_keys = ON",
        ):
            connection.execute(f"PRAGMA {pragma}")

    @event.listens_for(engine, "begin")
    def begin(connection: Connection) -> None:
        connection.exec_driver_sql(connection.get_execution_options().get(_BEGIN, "BEGIN"))
