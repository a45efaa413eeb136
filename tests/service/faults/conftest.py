"""A fleet of real processes on one database and one data folder, and what must hold of what they leave behind."""

import hashlib
import socket
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack
from dataclasses import replace
from datetime import timedelta
from functools import partial
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest
from sqlalchemy import Select, func, select, text
from sqlalchemy.orm import Session

from db.blobs import BlobStore
from db.database import Database
from db.tables import DetectionRow, FrictionModelRow, GraspLogRow, JobRow, RunnerRow, SampleSummaryRow
from service.jobs import garbage
from slipcore import GraspLog
from slipcore.contact.tiers.ramp import RampSchedule, tangential_ramp
from stiction_client.container import encode
from tests import forking, waiting

NPZ = "application/vnd.stiction.grasp-log+npz"
SHORT = RampSchedule(rest=0.2, press=0.5, settle=0.3, shear=1.5, hold=0.2)
TIMEOUT = 600.0
"""s; only against waiting for ever: a busy machine may take a minute to start a process."""


wait_until = partial(waiting.wait_until, seconds=TIMEOUT)


def worker_processes(pid: int) -> list[int]:
    """Those that a runner started and that live."""
    tasks = Path(f"/proc/{pid}/task").glob("*/children")
    children = [int(child) for task in tasks for child in task.read_text().split()]
    return [child for child in children if is_alive(child) and b"spawn_main" in command_line(child)]


def command_line(pid: int) -> bytes:
    try:
        return Path(f"/proc/{pid}/cmdline").read_bytes()
    except FileNotFoundError:
        return b""


def is_alive(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False


class Server:
    """One API process on a port of its own, with a client."""

    def __init__(self) -> None:
        with socket.socket() as probe:
            probe.bind(("127.0.0.1", 0))
            self.port = int(probe.getsockname()[1])
        self.url = f"http://127.0.0.1:{self.port}"
        self.client = httpx.Client(base_url=self.url, timeout=TIMEOUT)

    def upload(self, content: bytes, client: httpx.Client | None = None, **headers: str) -> httpx.Response:
        """The answer; threads need clients of their own."""
        headers |= {"content-type": NPZ}
        asked: dict[str, Any] = {"params": {"material": "paper"}, "content": content, "headers": headers}
        return (client or self.client).post("/v1/grasp-logs", **asked)

    def accept(self, content: bytes) -> str:
        """Upload, and return the log's id."""
        return str(self.upload(content).raise_for_status().json()["id"])

    def begin_upload(self, content: bytes, sent: int) -> socket.socket:
        """Send the first bytes of an upload only."""
        connection = socket.create_connection(("127.0.0.1", self.port))
        head = f"POST /v1/grasp-logs?material=paper HTTP/1.1\r\nHost: localhost\r\nContent-Type: {NPZ}\r\n"
        connection.sendall(f"{head}Content-Length: {len(content)}\r\n\r\n".encode() + content[:sent])
        return connection

    def is_ready(self) -> bool:
        try:
            return self.client.get("/readyz").status_code == httpx.codes.OK
        except httpx.TransportError:
            return False

    def make_material(self) -> None:
        self.client.post("/v1/materials", json={"name": "paper"}).raise_for_status()


METHODS_STORED = ("ols", "hierarchical")
"""Of which an ingest stores a model each."""


class Fleet:
    """Servers and workers on one folder and one database, each a process that can be killed and started again."""

    wait_until = staticmethod(wait_until)
    worker_processes = staticmethod(worker_processes)

    def __init__(self, folder: Path, database_url: str) -> None:
        self.folder, self.log = folder, folder.parent / "log"
        self.database = Database(database_url)
        self.servers: dict[Server, BaseProcess] = {}
        self.workers: list[BaseProcess] = []
        self.environment = {
            "STICTION_DATA_FOLDER": str(folder),
            "STICTION_DATABASE_URL": database_url,
            "STICTION_LEASE_SECONDS": "2",
            "STICTION_JOB_ATTEMPTS": "10",
            "STICTION_RATE_LIMIT": "0",
            "STICTION_LEAST_FREE_BYTES": "0",  # full disks are small ones here
        }

    def serve(self, server: Server | None = None, *, workers: int = 0) -> Server:
        """Start a server and wait until it is ready."""
        server = server or Server()
        self.begin_serving(server, workers=workers)
        self.wait_for(server)
        return server

    def begin_serving(self, server: Server, *, workers: int = 0, **environment: str) -> None:
        command = ("service.cli", "serve", f"--port={server.port}")
        self.servers[server] = self._start(*command, workers=workers, **environment)

    def wait_for(self, server: Server) -> None:
        def is_ready() -> bool:
            assert self.servers[server].is_alive(), self.log.read_text()[-5000:]
            return server.is_ready()

        wait_until(is_ready, "the server to be ready")

    def _start(self, *command: str, workers: int, **environment: str) -> BaseProcess:
        environment = self.environment | {"STICTION_WORKERS": str(workers)} | environment
        return forking.start_module(command, environment, self.log)

    def work(self) -> BaseProcess:
        """Start a worker, and do not wait until it is warm."""
        self.workers.append(self._start("service.cli", "worker", workers=1))
        return self.workers[-1]

    def kill(self, process: BaseProcess) -> None:
        """As a power cut would, except for the disk."""
        assert process.pid is not None
        processes = worker_processes(process.pid)
        process.kill()
        process.join()
        self.servers = {server: each for server, each in self.servers.items() if each is not process}
        self.workers = [each for each in self.workers if each is not process]
        wait_until(lambda: not any(map(is_alive, processes)), "the workers to end with their runner")

    def stop(self) -> None:
        """End all processes in peace; those that do not end are killed."""
        processes = [*self.servers.values(), *self.workers]
        for process in processes:
            process.terminate()
        for process in processes:
            process.join(60.0)
        late = [process for process in processes if process.is_alive()]
        for process in late:
            self.kill(process)
        for server in self.servers:
            server.client.close()
        self.servers, self.workers = {}, []
        self.database.close()
        assert not late, "a process did not end when it was told to"

    def all_ended(self) -> bool:
        return self.unfinished() == 0

    def unfinished(self) -> int:
        with self.database.read() as session:
            return session.scalar(select(func.count()).where(JobRow.finished_at.is_(None))) or 0

    def runners(self) -> set[int]:
        """Process ids of those that are known to the database."""
        return self._process_ids(select(RunnerRow.name))

    def at_work(self) -> set[int]:
        """Process ids of the runners that have claimed a job."""
        return self._process_ids(select(RunnerRow.name).join(JobRow, JobRow.runner_id == RunnerRow.id))

    def _process_ids(self, names: Select[tuple[str]]) -> set[int]:
        with self.database.read() as session:
            return {int(name.rpartition(":")[2]) for name in session.scalars(names)}

    def stored(self) -> set[str]:
        """Ids of the logs."""
        with self.database.read() as session:
            return set(session.scalars(select(GraspLogRow.id)))

    def check_consistent(self) -> None:
        """What must hold at any moment, also right after a kill and while others work."""
        with self.database.read() as session:
            if self.database.is_sqlite:
                assert session.execute(text("PRAGMA integrity_check")).scalars().all() == ["ok"]
                assert session.execute(text("PRAGMA foreign_key_check")).all() == []
            columns = (GraspLogRow.sha256, DetectionRow.history_blob, SampleSummaryRow.samples_blob)
            referenced = {sha256 for column in columns for sha256 in session.scalars(select(column))}
            assert set(session.scalars(select(JobRow.grasp_log_id))) == set(session.scalars(select(GraspLogRow.id)))
            current = session.scalars(select(FrictionModelRow.method).where(FrictionModelRow.current)).all()
            assert len(current) == len(set(current))
        assert referenced <= set(BlobStore(self.folder).hashes())

    def check_complete(self, accepted: Iterable[str]) -> None:
        """What must hold once all jobs have ended and what nothing refers to was set aside: all of it, and no more."""
        wait_until(self.all_ended, "all jobs to end")
        self.stop()
        self.serve()
        self.check_consistent()
        blobs = BlobStore(self.folder)
        garbage.set_aside(self.database, blobs, age=timedelta(0))
        stored = set(blobs.hashes())
        for sha256 in stored:
            assert hashlib.sha256(blobs.path(sha256).read_bytes()).hexdigest() == sha256
        assert list((self.folder / "spool").iterdir()) == []
        with self.database.read() as session:
            assert stored == _check_rows(session, sorted(accepted))


def _check_rows(session: Session, accepted: list[str]) -> set[str]:
    """That each log is complete exactly once; returns the hashes of what belongs to them."""
    logs = {row.id: row.sha256 for row in session.execute(select(GraspLogRow.id, GraspLogRow.sha256))}
    assert sorted(logs) == accepted
    assert set(session.scalars(select(DetectionRow.grasp_log_id))) == set(logs)
    assert set(session.execute(select(JobRow.status, JobRow.reason)).all()) <= {("done", None)}
    for method in METHODS_STORED:
        _check_models(session, method, len(logs))
    results = (DetectionRow.history_blob, SampleSummaryRow.samples_blob)
    return {*logs.values(), *(sha256 for column in results for sha256 in session.scalars(select(column)))}


def _check_models(session: Session, method: str, logs: int) -> None:
    """One of a method a job, versions without a gap, and the last of them, of all samples, current."""
    of_it = FrictionModelRow.method == method
    made = session.scalars(select(FrictionModelRow.job_id).where(of_it))
    assert Counter(made) == Counter(session.scalars(select(JobRow.id)))
    versions = session.scalars(select(FrictionModelRow.version).where(of_it).order_by(FrictionModelRow.version)).all()
    assert versions == list(range(1, logs + 1))
    current = select(FrictionModelRow.version, FrictionModelRow.n).where(of_it, FrictionModelRow.current)
    samples = sum(session.scalars(select(SampleSummaryRow.count)))
    assert [version for version, _ in session.execute(current)] == [logs] * bool(logs)
    if method == "ols":  # the recommended method may leave samples out
        assert [n for _, n in session.execute(current)] == [samples] * bool(logs)


@pytest.fixture
def new_fleet() -> Iterator[Callable[[Path, str], Fleet]]:
    """Makes a fleet that works in a folder and on a database; its processes end with the test."""
    with ExitStack() as fleets:

        def make(folder: Path, database_url: str) -> Fleet:
            fleet = Fleet(folder, database_url)
            fleets.callback(fleet.stop)
            return fleet

        yield make


@pytest.fixture
def fleet(tmp_path: Path, new_url: Callable[..., str], new_fleet: Callable[[Path, str], Fleet]) -> Fleet:
    (tmp_path / "data").mkdir()
    return new_fleet(tmp_path / "data", new_url(tmp_path))


@pytest.fixture(scope="session")
def ramp() -> GraspLog:
    """A short log of few markers, so that the network's and the database's faults decide and not what it holds."""
    return tangential_ramp(points=8, pitch=1.5e-3, schedule=SHORT, marker_noise=1e-7, force_noise=1e-6, seed=1)


@pytest.fixture(scope="session")
def contents() -> Callable[[int], list[bytes]]:
    """So many logs of one grasp, each with noise of its own."""
    grasp = tangential_ramp(points=8, pitch=1.5e-3, schedule=SHORT)
    assert grasp.force is not None
    displacement, force = grasp.displacement, grasp.force

    def noisy(seed: int) -> bytes:
        rng = np.random.default_rng(seed)
        moved = displacement + rng.normal(0.0, 1e-7, displacement.shape)
        return encode(replace(grasp, displacement=moved, force=force + rng.normal(0.0, 2e-4, force.shape)))

    return lambda count: [noisy(seed) for seed in range(count)]
