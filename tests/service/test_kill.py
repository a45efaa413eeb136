"""Real processes are killed at bad moments: what was accepted must end complete exactly once, the rest be gone."""

import hashlib
import os
import signal
import socket
import subprocess
import sys
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing, contextmanager, suppress
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest
from sqlalchemy import select, text, update
from sqlalchemy.orm import Session

from db.blobs import BlobStore
from db.database import Database
from db.tables import DetectionRow, FrictionModelRow, GraspLogRow, JobRow, RunnerRow, SampleSummaryRow
from slipcore.contact.ramp import RampSchedule, tangential_ramp
from stiction_client.container import encode

NPZ = "application/vnd.stiction.grasp-log+npz"
SHORT = RampSchedule(rest=0.2, press=0.5, settle=0.3, shear=1.5, hold=0.2)
KILLS = 200
Process = subprocess.Popen[bytes]


class Server:
    """One API process on a port of its own, with a client."""

    def __init__(self) -> None:
        with socket.socket() as probe:
            probe.bind(("127.0.0.1", 0))
            self.port = int(probe.getsockname()[1])
        self.client = httpx.Client(base_url=f"http://127.0.0.1:{self.port}", timeout=30.0)

    def upload(self, content: bytes) -> httpx.Response:
        return self.client.post(
            "/v1/grasp-logs", params={"material": "paper"}, content=content, headers={"content-type": NPZ}
        )

    def accept(self, content: bytes) -> str:
        """Upload, and return the log's id."""
        return str(self.upload(content).raise_for_status().json()["id"])

    def begin_upload(self, content: bytes, sent: int) -> socket.socket:
        """Send the first bytes of an upload only."""
        connection = socket.create_connection(("127.0.0.1", self.port))
        head = f"POST /v1/grasp-logs?material=paper HTTP/1.1\r\nHost: x\r\nContent-Type: {NPZ}\r\n"
        connection.sendall(f"{head}Content-Length: {len(content)}\r\n\r\n".encode() + content[:sent])
        return connection

    def is_ready(self) -> bool:
        try:
            return self.client.get("/readyz").status_code == httpx.codes.OK
        except httpx.TransportError:
            return False


class Fleet:
    """Servers and workers on one folder and one database, each a process that can be killed and started again."""

    def __init__(self, folder: Path, database_url: str) -> None:
        self.folder, self.database_url = folder, database_url
        self.processes: list[Process] = []
        self.environment = os.environ | {
            "STICTION_DATA_FOLDER": str(folder),
            "STICTION_DATABASE_URL": database_url,
            "STICTION_LEASE_SECONDS": "2",
            "STICTION_JOB_ATTEMPTS": "10",
        }

    def start(self, *command: str, workers: int, **options: Any) -> Process:
        environment = self.environment | {"STICTION_WORKERS": str(workers)}
        with (self.folder.parent / "log").open("ab") as log:
            process = subprocess.Popen(
                [sys.executable, "-m", *command], env=environment, stdout=log, stderr=subprocess.STDOUT, **options
            )
        self.processes.append(process)
        return process

    def serve(self, server: Server, workers: int = 0, **options: Any) -> Process:
        command = ("uvicorn", "service.app:create_app", "--factory", "--port", str(server.port))
        process = self.start(*command, workers=workers, **options)

        def is_ready() -> bool:
            assert process.poll() is None, (self.folder.parent / "log").read_text()[-5000:]
            return server.is_ready()

        wait_until(is_ready, "the server to be ready")
        return process

    def work(self) -> Process:
        return self.start("service.cli", "worker", workers=1)

    def kill(self, process: Process) -> None:
        """As a power cut would, except for the disk."""
        workers = descendants(process.pid)
        process.kill()
        process.wait()
        self.processes.remove(process)
        wait_until(lambda: not any(is_alive(pid) for pid in workers), "the workers to end with their runner")

    def stop(self) -> None:
        for process in self.processes:
            process.send_signal(signal.SIGTERM)
        for process in self.processes:
            process.wait(timeout=60)
        self.processes.clear()

    @contextmanager
    def database(self) -> Iterator[Session]:
        with closing(Database(self.database_url)) as database, database.write() as session:
            yield session

    def all_ended(self) -> bool:
        with self.database() as session:
            return not session.scalars(select(JobRow.id).where(JobRow.finished_at.is_(None)).limit(1)).all()


def wait_until(condition: Callable[[], bool], what: str) -> None:
    deadline = time.monotonic() + 240.0  # only against waiting for ever: a busy machine may take a minute to start
    while not condition():
        assert time.monotonic() < deadline, f"waited in vain for {what}"
        time.sleep(0.03)


def descendants(pid: int) -> list[int]:
    found = []
    for task in Path(f"/proc/{pid}/task").iterdir():
        for child in map(int, (task / "children").read_text().split()):
            found += [child, *descendants(child)]
    return found


def is_alive(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False


def check_consistent(fleet: Fleet) -> None:
    """What must hold at any moment, also right after a kill and while others work."""
    with fleet.database() as session:
        if fleet.database_url.startswith("sqlite"):
            assert session.execute(text("PRAGMA integrity_check")).scalars().all() == ["ok"]
            assert session.execute(text("PRAGMA foreign_key_check")).all() == []
        columns = (GraspLogRow.sha256, DetectionRow.history_blob, SampleSummaryRow.samples_blob)
        referenced = {sha256 for column in columns for sha256 in session.scalars(select(column))}
        assert set(session.scalars(select(JobRow.grasp_log_id))) == set(session.scalars(select(GraspLogRow.id)))
        assert sum(session.scalars(select(FrictionModelRow.current))) <= 1
    assert referenced <= set(BlobStore(fleet.folder).hashes())


def check_complete(fleet: Fleet, accepted: list[str]) -> None:
    """What must hold once all jobs have ended and a server that started alone has swept."""
    wait_until(fleet.all_ended, "all jobs to end")
    fleet.stop()
    sweeper = Server()
    fleet.serve(sweeper)
    sweeper.client.close()
    check_consistent(fleet)
    blobs = BlobStore(fleet.folder)
    stored = set(blobs.hashes())
    for sha256 in stored:
        assert hashlib.sha256(blobs.path(sha256).read_bytes()).hexdigest() == sha256
    assert list((fleet.folder / "spool").iterdir()) == []
    with fleet.database() as session:
        logs = dict(session.execute(select(GraspLogRow.id, GraspLogRow.sha256)).all())
        assert sorted(accepted) == sorted(logs)
        assert set(session.scalars(select(DetectionRow.grasp_log_id))) == set(logs)
        assert set(session.execute(select(JobRow.status, JobRow.reason)).all()) <= {("done", None)}
        assert Counter(session.scalars(select(FrictionModelRow.job_id))) == Counter(session.scalars(select(JobRow.id)))
        versions = list(session.scalars(select(FrictionModelRow.version).order_by(FrictionModelRow.version)))
        current = session.execute(
            select(FrictionModelRow.version, FrictionModelRow.n).where(FrictionModelRow.current)
        ).all()
        samples = sum(session.scalars(select(SampleSummaryRow.count)))
        found = {
            *session.scalars(select(DetectionRow.history_blob)),
            *session.scalars(select(SampleSummaryRow.samples_blob)),
        }
    assert versions == list(range(1, len(logs) + 1))
    assert current == [(len(logs), samples)] * bool(logs)
    assert stored == found | set(logs.values())


@pytest.fixture
def fleet(tmp_path: Path, new_url: Callable[..., str]) -> Iterator[Fleet]:
    (tmp_path / "data").mkdir()
    fleet = Fleet(tmp_path / "data", new_url(tmp_path))
    yield fleet
    fleet.stop()


@pytest.fixture
def server() -> Iterator[Server]:
    server = Server()
    yield server
    server.client.close()


def contents(count: int) -> list[bytes]:
    return [
        encode(tangential_ramp(points=8, pitch=1.5e-3, schedule=SHORT, marker_noise=1e-7, force_noise=1e-6, seed=seed))
        for seed in range(count)
    ]


def make_material(server: Server) -> None:
    server.client.post("/v1/materials", json={"name": "paper"}).raise_for_status()


@pytest.mark.parametrize("engine_name", ["sqlite"], indirect=True)
def test_a_server_killed_in_an_upload_and_in_jobs_leaves_all_or_nothing(fleet: Fleet, server: Server) -> None:
    first, second = contents(2)
    process = fleet.serve(server, workers=1)
    make_material(server)
    accepted = [server.accept(first)]
    sent = int(0.6 * len(second))
    with server.begin_upload(second, sent):
        spool = fleet.folder / "spool"
        wait_until(lambda: any(path.stat().st_size >= sent - 2**20 for path in spool.iterdir()), "the bytes to arrive")
        fleet.kill(process)  # while the first one's job runs
    check_consistent(fleet)
    with fleet.database() as session:
        assert session.scalars(select(GraspLogRow.id)).all() == accepted
    fleet.serve(server, workers=1)
    assert list((fleet.folder / "spool").iterdir()) == []
    accepted.append(server.accept(second))
    assert server.accept(first) == accepted[0]
    check_complete(fleet, accepted)


@pytest.mark.parametrize("engine_name", ["postgresql"], indirect=True)
def test_the_job_of_a_killed_worker_is_ended_by_another_without_doing_finished_stages_again(
    fleet: Fleet, server: Server
) -> None:
    """Two servers, and two workers one after the other, on one database."""
    other = Server()
    fleet.serve(server)
    fleet.serve(other)
    make_material(server)
    (content,) = contents(1)
    with ThreadPoolExecutor(2) as pool:  # the same log to both at once is one
        ids = set(pool.map(lambda each: each.accept(content), (server, other)))
    with fleet.database() as session:
        session.execute(update(JobRow).values(method="bayes"))  # whose fit takes long enough to be killed in
    worker = fleet.work()

    def stage() -> Any:
        return other.client.get("/v1/jobs").json()["items"][0]["stage"]

    wait_until(lambda: stage() == "friction_model", "the fit to begin")
    fleet.kill(worker)
    before = server.client.get("/v1/jobs").json()["items"][0]
    with fleet.database() as session:
        (detected,) = session.scalars(select(DetectionRow.created_at))
        (dead,) = session.scalars(select(RunnerRow.id))
    fleet.work()
    wait_until(fleet.all_ended, "the other worker to end the job")
    job = other.client.get("/v1/jobs").json()["items"][0]
    assert (job["status"], job["deaths"]) == ("done", 0)
    stages = ("frames", "slip_state", "samples")
    assert [job["seconds"][name] for name in stages] == [before["seconds"][name] for name in stages]
    with fleet.database() as session:
        assert session.scalars(select(DetectionRow.created_at)).all() == [detected]
        assert dead not in session.scalars(select(RunnerRow.id)).all()
    other.client.close()
    check_complete(fleet, list(ids))


class Campaign:
    """One server and two workers, of which one process after the other is killed while logs come in."""

    def __init__(self, fleet: Fleet, server: Server, seed: int) -> None:
        self.fleet, self.server = fleet, server
        self.rng = np.random.default_rng(seed)
        self.api = fleet.serve(server)
        self.workers = [fleet.work(), fleet.work()]
        make_material(server)
        self.killed: Counter[str] = Counter()

    def kill_one(self) -> None:
        """After a random time, a process of one of three kinds."""
        time.sleep(float(self.rng.uniform(0.0, 0.6)))
        kind = str(self.rng.choice(["server", "runner", "worker process"]))
        if kind == "server":
            self.fleet.kill(self.api)
        elif kind == "runner":
            self.fleet.kill(self.workers.pop(0))
            self.workers.append(self.fleet.work())
        elif processes := [pid for worker in self.workers for pid in descendants(worker.pid)]:
            os.kill(int(self.rng.choice(processes)), signal.SIGKILL)
        self.killed[kind] += 1

    def upload_and_kill(self, content: bytes) -> bool:
        """Whether the upload was answered before the kill."""
        answers: list[httpx.Response] = []

        def send() -> None:
            with suppress(httpx.TransportError):  # killed before its answer
                answers.append(self.server.upload(content))

        sender = threading.Thread(target=send)
        sender.start()
        self.kill_one()
        sender.join()
        if self.api.poll() is not None:
            self.api = self.fleet.serve(self.server)
        return any(answer.status_code == httpx.codes.ACCEPTED for answer in answers)


@pytest.mark.long
def test_processes_killed_at_random_moments_leave_all_or_nothing(fleet: Fleet, server: Server) -> None:
    campaign = Campaign(fleet, server, seed=1)
    logs = contents(KILLS)
    answered = []
    for content in logs:
        answered.append(campaign.upload_and_kill(content))
        check_consistent(fleet)
    accepted = [server.accept(content) for content in logs]  # those that were not answered are sent again
    check_complete(fleet, accepted)
    assert sum(campaign.killed.values()) == KILLS
    assert 0 < sum(answered) < KILLS
    assert min(campaign.killed.values()) > KILLS // 5


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    folder = tmp_path / "data"
    folder.mkdir()
    if subprocess.run(["mount", "-t", "tmpfs", "-o", "size=12m", "tmpfs", folder], capture_output=True).returncode:
        pytest.skip("a small file system cannot be mounted here")
    yield folder
    subprocess.run(["umount", "--lazy", folder], check=True)


def fill(folder: Path) -> Path:
    """Leave no byte free."""
    filler = folder / "filler"
    with filler.open("wb", buffering=0) as file, suppress(OSError):
        while True:
            file.write(bytes(4096))
    return filler


@pytest.mark.long
def test_a_full_disk_refuses_uploads_and_lets_jobs_wait(small_disk: Path) -> None:
    fleet, server = Fleet(small_disk, f"sqlite:///{small_disk}/stiction.sqlite3"), Server()
    first, second = contents(2)
    try:
        fleet.serve(server)
        make_material(server)
        accepted = [server.accept(first)]
        filler = fill(small_disk)
        refused = server.upload(second)
        assert (refused.status_code, refused.json()["type"]) == (503, "/problems/storage-unavailable")
        assert server.client.get("/readyz").status_code == httpx.codes.SERVICE_UNAVAILABLE
        filler.unlink()
        worker = fleet.work()
        wait_until(lambda: len(descendants(worker.pid)) > 0, "the worker to start")
        filler = fill(small_disk)
        assert server.client.get("/v1/materials/paper").status_code == httpx.codes.OK
        time.sleep(1.0)
        filler.unlink()
        accepted.append(server.accept(second))
        wait_until(fleet.all_ended, "the jobs to end once there is room")
        assert worker.poll() is None
        check_complete(fleet, accepted)
    finally:
        fleet.stop()
        server.client.close()
