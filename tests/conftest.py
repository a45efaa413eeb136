"""A real PostgreSQL server, and a store like S3, for whoever asks for them."""

import gc
import os
import re
import shutil
import threading
import time
from collections.abc import Callable, Generator, Iterator, Mapping
from contextlib import closing
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import httpx
import hypothesis
import numpy as np
import pytest
import uvicorn
from sqlalchemy import Dialect
from sqlalchemy.sql import ClauseElement
from sqlalchemy.util import LRUCache
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from benchmarks.service.postgresql import MEMORY, NoPrograms, PostgreSQL, has_room, running_postgresql
from db import migrate
from db.database import Database
from db.records import Claim
from db.repositories import jobs, runners
from slipcore.contact.reference.cattaneo_mindlin import CattaneoMindlin
from slipcore.contact.tiers import ramp
from tests import prompt_ends
from tests.migrations import Remembered

hypothesis.settings.register_profile("suite", derandomize=True, deadline=None)  # the same cases in each run
hypothesis.settings.load_profile("suite")

FAST = ("fsync=off", "full_page_writes=off", "synchronous_commit=off")
"""No promise for power cuts, which no test makes: a database a test then costs 35 ms, and half of that in memory."""


GARBAGE = (10_000, 20, 50)
"""After so many new objects, collections and older ones garbage is collected: half of the 4 % of the time that it takes
at Python's 700, 10 and 10.
"""

ENGINES = ("sqlite", "postgresql")

RAMP_FRAMES = 2000
"""Kept in a process, of 10 to 30 kB each."""

FOLDERS = 4 * 2**30
"""Bytes in memory that must be free for the tests' folders: a whole run writes 2 GB and keeps those of failed tests."""

if has_room(MEMORY, FOLDERS):  # SQLite waits 4 to 10 ms for a disk in each transaction
    os.environ.setdefault("PYTEST_DEBUG_TEMPROOT", str(MEMORY))


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """Collect no garbage while tests are collected, a fifth of the time that it takes, and leave what there is then
    out of later collections, which were a fifth of the time of some tests. To look for garbage in it takes a second.
    """
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.set_threshold(*GARBAGE)
        gc.enable()


def pytest_sessionstart(session: pytest.Session) -> None:
    """Let a process of xdist tell of each test how it went, and not that it began, was set up, was left and ended.

    Each message takes a tenth of a millisecond in this process and in the one that is told.
    """
    told_all = session.config.getoption("durations") is not None or session.config.getoption("verbose") > 0
    worker = next((each for each in session.config.pluginmanager.get_plugins() if hasattr(each, "sendevent")), None)
    if worker is None or told_all:
        return
    send = worker.sendevent

    def send_what_matters(name: str, **told: Any) -> None:
        report = told.get("data", {})
        is_of_course = name == "testreport" and report["when"] != "call" and report["outcome"] == "passed"
        if name not in {"logstart", "logfinish"} and not is_of_course:
            send(name, **told)

    worker.sendevent = send_what_matters


@pytest.fixture(scope="session")
def postgresql() -> Iterator[PostgreSQL]:
    """One server a test process; skips where the wheel has no programs for this machine."""
    try:
        with running_postgresql(*FAST, in_memory=True) as server:
            yield server
    except NoPrograms as error:
        pytest.skip(str(error))


@pytest.fixture(scope="session")
def template(postgresql: PostgreSQL) -> str:
    return postgresql.migrated()


@pytest.fixture(scope="session", autouse=True)
def migrations() -> Iterator[Remembered]:
    """What the migrations make of an empty file, and how it compares with the tables of the code, once a process.

    They run where a test asks for ``real_migrations``, and in other processes. Their files are read once as well, and
    not for each way up and down.
    """
    with pytest.MonkeyPatch.context() as patched:
        remembered = Remembered()
        patched.setattr("db.migrate.command.ScriptDirectory", SimpleNamespace(from_config=lambda _: migrate._scripts()))
        patched.setattr("db.migrate.command.upgrade", remembered.upgrade)
        patched.setattr("db.migrate.compare_metadata", remembered.compare)
        yield remembered


@pytest.fixture(scope="session", autouse=True)
def prompt_servers() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patched:
        prompt_ends.patch(patched)
        yield


@pytest.fixture(scope="session", autouse=True)
def statements_compiled_once() -> Iterator[None]:
    """SQLAlchemy compiles each statement anew for each engine, and most tests of a database have one of their own."""
    compile_with_cache, caches = ClauseElement._compile_w_cache, dict[object, tuple[Dialect, LRUCache[Any, Any]]]()

    def compile_once(self: ClauseElement, dialect: Dialect, **options: Any) -> Any:
        kind = (type(dialect), dialect.server_version_info)
        first, cache = caches.setdefault(kind, (dialect, LRUCache(5000)))
        return compile_with_cache(self, first, **options | {"compiled_cache": cache})

    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(ClauseElement, "_compile_w_cache", compile_once)
        yield


@pytest.fixture(scope="session", autouse=True)
def certificates_read_once() -> Iterator[None]:
    """Each client of httpx reads all that are trusted, 20 ms, and none here asks for an https address."""
    with pytest.MonkeyPatch.context() as patched:
        create = "httpx._transports.default.create_ssl_context"
        patched.setattr(create, cache(httpx.create_ssl_context))
        yield


@pytest.fixture(scope="session", autouse=True)
def ramps_computed_once() -> Iterator[None]:
    """The same few ramps are seen by many tests, with another noise each: their frames in closed form are kept."""
    fields, frames = ramp._fields, LRUCache[Any, ramp._Fields](RAMP_FRAMES)

    def compute_once(load: CattaneoMindlin, position: np.ndarray, element_area: float) -> ramp._Fields:
        key = (load, position.shape, position.tobytes(), element_area)
        if key not in frames:
            frames[key] = fields(load, position, element_area)
        return frames[key]

    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(ramp, "_fields", compute_once)
        yield


@pytest.fixture
def real_migrations(migrations: Remembered, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each migration in its turn."""
    monkeypatch.setattr("db.migrate.command.upgrade", migrations.real_upgrade)
    monkeypatch.setattr("db.migrate.compare_metadata", migrations.real_compare)


@pytest.fixture(scope="session", params=ENGINES)
def engine_name(request: pytest.FixtureRequest) -> str:
    """Each database that the service runs on."""
    name: str = request.param
    return name


@pytest.fixture(scope="session")
def sqlite_template(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A file at the newest revision: a copy takes a millisecond, the migrations 250."""
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


NO_SUCH_KEY = Response("<Error><Code>NoSuchKey</Code></Error>", 404, media_type="application/xml")


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
        if source := request.headers.get("x-amz-copy-source"):
            return self._copy(source.partition("/grasps/")[2] or source.removeprefix("grasps/"), key)
        answers = {"PUT": self._put, "GET": self._get, "HEAD": self._get, "DELETE": self._delete, "POST": self._post}
        return answers[request.method](key, body, request.query_params)

    def _put(self, key: str, body: bytes, query: Mapping[str, str]) -> Response:
        if "uploadId" in query:
            self._parts[query["uploadId"]][int(query["partNumber"])] = body
        else:
            self.objects[key] = body
        return Response(headers={"ETag": '"1"'})

    def _copy(self, source: str, key: str) -> Response:
        if source not in self.objects:
            return NO_SUCH_KEY
        self.objects[key] = self.objects[source]
        return Response("<CopyObjectResult><ETag>1</ETag></CopyObjectResult>", media_type="application/xml")

    def _get(self, key: str, _body: bytes, query: Mapping[str, str]) -> Response:
        if not key:
            return self._list(query.get("prefix", ""))
        if key not in self.objects:
            return NO_SUCH_KEY
        day = "Mon, 03" if "clock/" in key else "Sat, 01"  # all else was written two days before
        headers = {"ETag": '"1"', "Last-Modified": f"{day} Nov 2025 10:00:00 GMT"}
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


@pytest.fixture(scope="session")
def s3_server() -> Iterator[tuple[str, dict[str, S3]]]:
    """The URL of one server for all tests, a tenth of a second to end, and the S3 that answers there now."""
    serving: dict[str, S3] = {}

    async def answer(request: Request) -> Response:
        return await serving["now"].answer(request)

    route = Route("/grasps/{key:path}", answer, methods=["GET", "HEAD", "PUT", "POST", "DELETE"])
    bucket = Route("/grasps", answer, methods=["GET", "POST"])
    app = Starlette(routes=[route, bucket])
    config = uvicorn.Config(app, port=0, log_level="error", ws="none", lifespan="off")
    running = uvicorn.Server(config)
    thread = threading.Thread(target=running.run)
    thread.start()
    while not running.started:
        assert thread.is_alive()
        time.sleep(0.005)
    yield f"http://127.0.0.1:{running.servers[0].sockets[0].getsockname()[1]}", serving
    running.should_exit = True
    thread.join()


@pytest.fixture
def s3(s3_server: tuple[str, dict[str, S3]], monkeypatch: pytest.MonkeyPatch) -> S3:
    """An S3 on loopback, empty, whose one bucket is named ``grasps``; the environment leads there."""
    url, serving = s3_server
    monkeypatch.setenv("AWS_ENDPOINT_URL", url)
    for name, value in {"ALLOW_HTTP": "true", "ACCESS_KEY_ID": "a", "SECRET_ACCESS_KEY": "b", "REGION": "x"}.items():
        monkeypatch.setenv(f"AWS_{name}", value)
    serving["now"] = S3()
    return serving["now"]


@pytest.fixture
def claim(database: Database) -> Callable[[], Claim]:
    """Give the oldest queued job to a runner of its own."""

    def make() -> Claim:
        with database.write() as session:
            made = jobs.claim(session, runners.add(session, "host:1"))
        assert made is not None
        return made

    return make
