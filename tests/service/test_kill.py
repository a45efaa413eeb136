"""A real server process is killed at bad moments: what it accepted must end complete exactly once, the rest be gone."""

import hashlib
import os
import signal
import socket
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest
from sqlalchemy import select, text
from sqlalchemy.orm import Session

from db.blobs import BlobStore
from db.database import Database
from db.tables import DetectionRow, FrictionModelRow, GraspLogRow, JobRow, SampleSummaryRow
from slipcore.contact.ramp import tangential_ramp
from stiction_client.container import encode

NPZ = "application/vnd.stiction.grasp-log+npz"


class Victim:
    """A server in a process of its own, started and killed again and again in one folder."""

    def __init__(self, folder: Path, database_url: str) -> None:
        self.folder, self.database_url = folder, database_url
        with socket.socket() as probe:
            probe.bind(("127.0.0.1", 0))
            self.port = int(probe.getsockname()[1])
        self.client = httpx.Client(base_url=f"http://127.0.0.1:{self.port}", timeout=30.0)
        self.process: subprocess.Popen[bytes] | None = None

    def start(self) -> None:
        command = [sys.executable, "-m", "uvicorn", "service.app:create_app", "--factory", "--port", str(self.port)]
        environment = os.environ | {
            "STICTION_DATA_FOLDER": str(self.folder),
            "STICTION_DATABASE_URL": self.database_url,
        }
        with (self.folder / "server.log").open("ab") as log:
            self.process = subprocess.Popen(command, env=environment, stdout=log, stderr=subprocess.STDOUT)
        wait_until(self.is_ready, "the server to be ready")

    def is_ready(self) -> bool:
        assert self.process is not None
        assert self.process.poll() is None, (self.folder / "server.log").read_text()
        try:
            return self.client.get("/readyz").status_code == httpx.codes.OK
        except httpx.TransportError:
            return False

    def kill(self) -> None:
        """As a power cut would, except for the disk."""
        assert self.process is not None
        workers = descendants(self.process.pid)
        self.process.kill()
        self.process.wait()
        self.process = None
        wait_until(lambda: not any(is_alive(pid) for pid in workers), "the workers to end with their server")

    def upload(self, content: bytes) -> dict[str, Any]:
        response = self.client.post(
            "/v1/grasp-logs", params={"material": "paper"}, content=content, headers={"content-type": NPZ}
        )
        accepted: dict[str, Any] = response.raise_for_status().json()
        return accepted

    def begin_upload(self, content: bytes, sent: int) -> socket.socket:
        """Send the first bytes of an upload only."""
        connection = socket.create_connection(("127.0.0.1", self.port))
        head = f"POST /v1/grasp-logs?material=paper HTTP/1.1\r\nHost: x\r\nContent-Type: {NPZ}\r\n"
        connection.sendall(f"{head}Content-Length: {len(content)}\r\n\r\n".encode() + content[:sent])
        return connection

    def wait_for_jobs(self) -> None:
        with self.database() as session:
            ids = list(session.scalars(select(JobRow.id)))
        wait_until(
            lambda: all(self.client.get(f"/v1/jobs/{id_}").json()["finished_at"] for id_ in ids), "all jobs to end"
        )

    @contextmanager
    def database(self) -> Iterator[Session]:
        with closing(Database(self.database_url)) as database, database.read() as session:
            yield session


def wait_until(condition: Callable[[], bool], what: str) -> None:
    deadline = time.monotonic() + 240.0  # only against waiting for ever: a busy machine may take a minute to start
    while not condition():
        assert time.monotonic() < deadline, f"waited in vain for {what}"
        time.sleep(0.005)


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


def check_consistent(victim: Victim) -> None:
    """What must hold at any moment, also right after a kill."""
    blobs = BlobStore(victim.folder)
    stored = set(blobs.hashes())
    for sha256 in stored:
        assert hashlib.sha256(blobs.path(sha256).read_bytes()).hexdigest() == sha256
    with victim.database() as session:
        if victim.database_url.startswith("sqlite"):
            assert session.execute(text("PRAGMA integrity_check")).scalars().all() == ["ok"]
            assert session.execute(text("PRAGMA foreign_key_check")).all() == []
        for column in (GraspLogRow.sha256, DetectionRow.history_blob, SampleSummaryRow.samples_blob):
            assert set(session.scalars(select(column))) <= stored
        assert set(session.scalars(select(JobRow.grasp_log_id))) == set(session.scalars(select(GraspLogRow.id)))
        assert sum(session.scalars(select(FrictionModelRow.current))) <= 1


def check_complete(victim: Victim, accepted: list[str]) -> None:
    """What must hold once a restarted server has done its work."""
    victim.wait_for_jobs()
    check_consistent(victim)
    blobs = BlobStore(victim.folder)
    assert list((victim.folder / "spool").iterdir()) == []
    with victim.database() as session:
        logs = dict(session.execute(select(GraspLogRow.id, GraspLogRow.sha256)).all())
        assert set(accepted) == set(logs)
        assert set(session.scalars(select(DetectionRow.grasp_log_id))) == set(logs)
        assert set(session.scalars(select(JobRow.status))) <= {"done"}
        assert Counter(session.scalars(select(FrictionModelRow.job_id))) == Counter(session.scalars(select(JobRow.id)))
        versions = list(session.scalars(select(FrictionModelRow.version).order_by(FrictionModelRow.version)))
        current = session.scalars(select(FrictionModelRow).where(FrictionModelRow.current)).all()
        samples = sum(session.scalars(select(SampleSummaryRow.count)))
        found = {
            *session.scalars(select(DetectionRow.history_blob)),
            *session.scalars(select(SampleSummaryRow.samples_blob)),
        }
    assert versions == list(range(1, len(logs) + 1))
    assert [(model.version, model.n) for model in current] == [(len(logs), samples)] * bool(logs)
    assert set(blobs.hashes()) - found - set(logs.values()) == set()


@pytest.fixture
def victim(tmp_path: Path, new_url: Callable[..., str]) -> Iterator[Victim]:
    victim = Victim(tmp_path, new_url(tmp_path))
    victim.start()
    victim.client.post("/v1/materials", json={"name": "paper"}).raise_for_status()
    yield victim
    if victim.process is not None:
        victim.process.send_signal(signal.SIGTERM)
        victim.process.wait(timeout=60)
    victim.client.close()


def contents(count: int) -> list[bytes]:
    return [encode(tangential_ramp(points=20, marker_noise=1e-6, seed=seed)) for seed in range(count)]


def kill_in_an_upload(victim: Victim, content: bytes, part: float) -> None:
    sent = int(part * len(content))
    spool = victim.folder / "spool"
    with victim.begin_upload(content, sent):
        wait_until(lambda: any(path.stat().st_size >= sent - 2**20 for path in spool.iterdir()), "the bytes to arrive")
        victim.kill()


def kill_after(victim: Victim, content: bytes, seconds: float) -> str:
    log_id = str(victim.upload(content)["id"])
    time.sleep(seconds)
    victim.kill()
    return log_id


def test_a_server_killed_in_an_upload_and_in_jobs_leaves_all_or_nothing(victim: Victim) -> None:
    first, second = contents(2)
    accepted = [str(victim.upload(first)["id"])]
    kill_in_an_upload(victim, second, 0.6)  # while the first one's job runs
    check_consistent(victim)
    with victim.database() as session:
        assert session.scalars(select(GraspLogRow.id)).all() == accepted
    victim.start()
    assert list((victim.folder / "spool").iterdir()) == []
    accepted.append(kill_after(victim, second, 0.1))
    check_consistent(victim)
    victim.start()
    check_complete(victim, accepted)
    assert victim.upload(first)["id"] == accepted[0]


@pytest.mark.long
@pytest.mark.parametrize("seed", range(4))
def test_a_server_killed_at_random_moments_leaves_all_or_nothing(victim: Victim, seed: int) -> None:
    rng = np.random.default_rng(seed)
    accepted = []
    for content in contents(12):
        if rng.random() < 0.3:
            kill_in_an_upload(victim, content, float(rng.uniform(0.0, 0.999)))
        else:
            accepted.append(kill_after(victim, content, float(rng.uniform(0.0, 0.6))))
        check_consistent(victim)
        victim.start()
    check_complete(victim, accepted)
