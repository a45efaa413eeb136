import asyncio
import io
import itertools
import threading
import time
import zlib
from collections import defaultdict
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import httpx
import numpy as np
import pytest
import typer.main
import uvicorn
from fastapi import FastAPI

from db.blobs import BlobStore
from db.database import Database
from db.records import NewModel
from db.repositories import access_keys, friction_models, jobs, materials
from service.app import create_app
from service.domain.access import keys
from service.domain.jobs.await_job import MOST_SECONDS
from service.domain.models.model_cache import ModelCache
from service.http.context import ServerContext
from service.jobs import worker
from service.observability import logs
from service.serving import configuration
from service.settings import Settings
from slipcore import GraspLog
from slipcore.contact.tiers.ramp import RampSchedule, tangential_ramp
from stiction_client.container import encode
from tests import forking
from tests.conftest import ENGINES
from tests.waiting import wait_until

NPZ = "application/vnd.stiction.grasp-log+npz"
SHORT = RampSchedule(rest=0.2, press=0.5, settle=0.3, shear=1.5, hold=0.2)

Members = dict[str, Any]
ROOM = Path(__file__).parent


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Leave each test of the service on one of both databases to ``make test-long``, half of them on each.

    Statements stand in ``db`` alone, whose own tests always take both.
    """
    alike = defaultdict(list)
    for item in items:
        engine = getattr(getattr(item, "callspec", None), "params", {}).get("engine_name")
        if engine is not None and ROOM in item.path.parents:
            alike[item.nodeid.replace(engine, "")].append(item)
    for name, tests in alike.items():
        if len(tests) == len(ENGINES):
            tests[zlib.crc32(name.encode()) % len(ENGINES)].add_marker(pytest.mark.long)


@contextmanager
def serve(settings: Settings) -> Iterator[httpx.Client]:
    """A real server on a free loopback port, in a thread of this process (its workers are processes)."""
    forking.begin()
    server = uvicorn.Server(configuration(settings.model_copy(update={"port": 0}), log_level="warning"))
    thread = threading.Thread(target=server.run)
    thread.start()
    while not server.started:
        assert thread.is_alive(), "the server did not start"
        time.sleep(0.005)
    port = server.servers[0].sockets[0].getsockname()[1]
    try:
        with httpx.Client(base_url=f"http://127.0.0.1:{port}", timeout=60.0) as client:
            yield client
    finally:
        server.should_exit = True
        thread.join()


@dataclass
class Caller:
    """Somebody who asks the application itself, from a network address of his own."""

    app: FastAPI
    server: str
    address: str
    headers: dict[str, str]

    def request(self, method: str, path: str, **more: Any) -> httpx.Response:
        return asyncio.run(self._request(method, path, **more))

    def get(self, path: str, **more: Any) -> httpx.Response:
        return self.request("GET", path, **more)

    async def _request(self, method: str, path: str, **more: Any) -> httpx.Response:
        transport = httpx.ASGITransport(self.app, raise_app_exceptions=False, client=(self.address, 50000))
        url = f"http://{self.server}"
        options: Any = {"transport": transport, "base_url": url, "headers": self.headers, "trust_env": False}
        async with httpx.AsyncClient(**options) as client:
            return await client.request(method, path, **more)

    def open_stream(self, path: str) -> httpx.Response:
        """What a WebSocket is answered before it is open."""
        headers = [(name.lower().encode(), value.encode()) for name, value in self.headers.items()]
        ends = {"server": (self.server, 80), "client": (self.address, 50000)}
        scope = {"type": "websocket", "path": path, "raw_path": path.encode(), "query_string": b"", "headers": headers}
        sent: list[Any] = []
        said = iter(["websocket.connect"])

        async def receive() -> dict[str, str]:
            return {"type": next(said, "websocket.disconnect")}

        async def send(message: Any) -> None:
            sent.append(message)

        scope |= ends | {"scheme": "ws", "extensions": {"websocket.http.response": {}}, "subprotocols": []}  # type: ignore[dict-item]
        asyncio.run(self.app(scope, receive, send))
        if sent[0]["type"] == "websocket.accept":
            return httpx.Response(101)
        return httpx.Response(sent[0]["status"], headers=sent[0]["headers"], content=sent[1]["body"])


@pytest.fixture(scope="session", autouse=True)
def quick_processes() -> Iterator[None]:
    """Processes of servers in this process begin in no time; those of ``stiction serve`` begin from nothing."""
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr("service.processes.spawned.CONTEXT", forking.Context())
        yield


@pytest.fixture(scope="session", autouse=True)
def one_command_tree() -> Iterator[None]:
    """Typer makes all commands anew at each call; the tests call hundreds of times."""
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr("typer.main.get_command", cache(typer.main.get_command))
        yield


@pytest.fixture(autouse=True)
def no_open_stores() -> Iterator[None]:
    """Jobs that a test does in its own process keep their stores open, which are no other test's."""
    yield
    worker.close_stores()


@pytest.fixture(autouse=True)
def own_log_fields() -> Iterator[None]:
    """Jobs that a test does in its own process note fields for the log, which are no other test's."""
    with logs.log_context():
        yield


@pytest.fixture
def reach(database: Database, blobs: BlobStore) -> Callable[..., Caller]:
    """Reach an application of its own on the database; its jobs stay queued."""

    def client(
        access: str = "auto", server: str = "10.0.0.5", address: str = "10.0.0.9", key: str = "", **settings: Any
    ) -> Caller:
        chosen = Settings.model_validate({"access": access, "lookup_seconds": 0.0, **settings})
        app = create_app(chosen)
        jobs: Any = SimpleNamespace(wake=lambda: None, ending=lambda _: asyncio.Event())
        app.state.context = ServerContext(chosen, database, blobs, jobs, models=ModelCache(chosen.lookup_seconds))
        return Caller(app, server, address, {"Authorization": f"Bearer {key}"} if key else {})

    return client


@pytest.fixture
def make(database: Database) -> Callable[..., str]:
    """Store an access key and return its text."""

    def make_key(scope: str = "read", **more: Any) -> str:
        key_id, text = keys.new_key()
        with database.write() as session:
            access_keys.add(session, key_id, "robot", scope, keys.digest(text), **more)
        return text

    return make_key


@pytest.fixture(scope="session")
def serving() -> Callable[[Settings], AbstractContextManager[httpx.Client]]:
    return serve


@pytest.fixture(scope="session")
def served(engine_name: str, request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Settings:
    """The settings of the server that all tests share, on each database."""
    url = None
    if engine_name == "postgresql":
        url = request.getfixturevalue("postgresql").create(request.getfixturevalue("template"))
    folder = tmp_path_factory.mktemp("served")
    return Settings(data_folder=folder, database_url=url, max_upload_bytes=2 * 2**20, poll_seconds=5.0)


@pytest.fixture(scope="session")
def client(served: Settings) -> Iterator[httpx.Client]:
    """A client of one server that all tests share: each makes materials of its own."""
    with serve(served) as client:
        client.headers["x-data-folder"] = str(served.data_folder)
        wait_until(lambda: client.get("/readyz").status_code == httpx.codes.OK, "the server to be ready")
        yield client


_numbers = itertools.count(1)


@pytest.fixture
def material(client: httpx.Client) -> str:
    name = f"material {next(_numbers)}"
    client.post("/v1/materials", json={"name": name}).raise_for_status()
    return name


@pytest.fixture(scope="session")
def ramp() -> GraspLog:
    """Pressed, then sheared: 82 frames of 8×8 markers, μ = 0.4."""
    return tangential_ramp(points=14, pitch=0.9e-3, schedule=SHORT, marker_noise=1e-7, force_noise=1e-6, seed=1)


@pytest.fixture(scope="session")
def content(ramp: GraspLog) -> bytes:
    return encode(ramp)


@pytest.fixture(scope="session")
def members(content: bytes) -> Members:
    """The members of the ramp's container; replace some and ``repack``."""
    with np.load(io.BytesIO(content)) as archive:
        return dict(archive)


@pytest.fixture(scope="session")
def repack() -> Callable[[Members], bytes]:
    def pack(members: Members) -> bytes:
        buffer = io.BytesIO()
        np.savez(buffer, **members)
        return buffer.getvalue()

    return pack


@pytest.fixture(scope="session")
def upload() -> Callable[..., httpx.Response]:
    def send(client: httpx.Client, content: bytes, content_type: str = NPZ, **query: str) -> httpx.Response:
        return client.post("/v1/grasp-logs", params=query, content=content, headers={"content-type": content_type})

    return send


@pytest.fixture(scope="session")
def wait() -> Callable[[httpx.Client, str], Members]:
    def until_finished(client: httpx.Client, job_id: str) -> Members:
        deadline = time.monotonic() + 60.0
        while time.monotonic() < deadline:  # an answer at the end: who asks again and again keeps two threads busy
            asked = client.get(f"/v1/jobs/{job_id}", params={"wait": MOST_SECONDS}, timeout=60.0)
            job: Members = asked.raise_for_status().json()
            if job["finished_at"] is not None:
                return job
        raise AssertionError(f"job {job_id} does not end: {job}")

    return until_finished


@pytest.fixture(scope="session")
def fitted(
    client: httpx.Client, content: bytes, upload: Callable[..., httpx.Response], wait: Callable[..., Members]
) -> Members:
    """A log of the material "fitted" that went all the way."""
    client.post("/v1/materials", json={"name": "fitted"}).raise_for_status()
    accepted = upload(client, content, material="fitted")
    assert accepted.status_code == httpx.codes.ACCEPTED, accepted.text
    job = wait(client, accepted.json()["job"]["id"])
    assert job["status"] == "done", job
    log: Members = client.get(accepted.headers["location"]).json()
    return log


@pytest.fixture
def database(new_url: Callable[..., str], tmp_path: Path) -> Iterator[Database]:
    database = Database(new_url(tmp_path))
    yield database
    database.close()


@pytest.fixture
def blobs(tmp_path: Path) -> BlobStore:
    return BlobStore(tmp_path)


@pytest.fixture
def new_model() -> NewModel:
    zero = ((1e-4, 0.0, 0.0), (0.0, 1e-4, 0.0), (0.0, 0.0, 1e-4))
    numbers: dict[str, Any] = {"degrees_of_freedom": 9.0, "scatter_degrees_of_freedom": None, "element_area": 1e-6}
    ranges: dict[str, Any] = {"tangential_velocity": (0.0, 0.01), "normal_force": (0.01, 0.1)}
    costs: dict[str, Any] = {"diagnostics": {}, "cost_seconds": 0.0, "monte_carlo_error": 0.0}
    return NewModel("ols", (0.4, 0.0, 0.0), zero, 0.02, 9, identifiable=(True,) * 3, **numbers, **ranges, **costs)


@pytest.fixture
def store(database: Database, new_model: NewModel) -> Callable[[], None]:
    """Store a version of the model as another process does: this one is not told."""

    def add() -> None:
        with database.write() as session:
            found = materials.list_all(session)
            material = found[0].id if found else materials.create(session, "paper", "").id
            job = jobs.add(session, "fit", "ols", material_id=material)
            friction_models.add(session, material, job, new_model)

    add()
    return add
