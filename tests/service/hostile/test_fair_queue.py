"""An honest key's uploads beside an attacker's, who has one key and sends long logs as fast as they are taken."""

import asyncio
import itertools
import os
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from pathlib import Path
from statistics import median

import httpx
import numpy as np
import pytest
from sqlalchemy import select

from db.blobs import BlobStore
from db.database import Database
from db.records import Claim
from db.repositories import jobs
from db.tables import JobRow
from service.domain.uploads import accept
from service.jobs import executors, worker
from service.settings import Settings
from slipcore import GraspLog
from stiction_client import container
from tests.service.grasps import same_grasp

NPZ = "application/vnd.stiction.grasp-log+npz"
TIMES = 5.0
"""How many times its quiet time an honest upload may take beside the attacker."""

UPLOADS = 5

TURNS = 3
"""Of an upload alone and one beside the attack, where server and attackers are in this process."""

JOB_SECONDS = 60.0
"""s that a short job is waited for: a hundred times what it takes."""

START_SECONDS = 180.0
"""s that a server is waited for, which loads compiled kernels in two processes."""

Serving = Callable[[Settings], AbstractContextManager[httpx.Client]]
Logs = Callable[[], bytes]


@dataclass(frozen=True)
class Times:
    """Seconds from an upload's begin to its answer, and to the end of its job."""

    answer: float
    job: float


def send(client: httpx.Client, content: bytes, **query: str) -> httpx.Response:
    return client.post("/v1/grasp-logs", params=query, content=content, headers={"content-type": NPZ})


def timed(client: httpx.Client, content: bytes, within: float = JOB_SECONDS) -> Times:
    """Upload a short log and wait for its job, as somebody who asks how far it is, for so many seconds at most.

    A request that waits would see the end of a job of another process up to 0.25 s late.
    """
    began = time.monotonic()
    answer = send(client, content).raise_for_status()
    answered = time.monotonic() - began
    job_id = answer.json()["job"]["id"]
    while (job := client.get(f"/v1/jobs/{job_id}").raise_for_status().json())["finished_at"] is None:
        assert time.monotonic() < began + within, job
        time.sleep(0.01)
    assert job["status"] == "done", job
    return Times(answered, time.monotonic() - began)


def medians(found: Sequence[Times]) -> Times:
    return Times(median(each.answer for each in found), median(each.job for each in found))


def by_turns(
    client: httpx.Client, honest: Logs, attack: Callable[[], AbstractContextManager[None]]
) -> tuple[Times, Times]:
    """The medians of uploads alone and of those beside the attack: what else the machine does is in both."""
    quiet, beside = [], []
    for _ in range(TURNS):
        quiet.append(timed(client, honest()))
        with attack():
            beside.append(timed(client, honest()))
    return medians(quiet), medians(beside)


@contextmanager
def flood(url: str, key: str, long: Logs, connections: int) -> Iterator[None]:
    """Several connections with one key, each of which sends the next long log as soon as one is answered."""
    ended, taken = threading.Event(), threading.Semaphore(0)

    def attack() -> None:
        with httpx.Client(base_url=url, headers={"Authorization": f"Bearer {key}"}, timeout=60.0) as client:
            while not ended.is_set():
                if send(client, long(), detector="rigid_fit").status_code == httpx.codes.ACCEPTED:
                    taken.release()

    threads = [threading.Thread(target=attack) for _ in range(connections)]
    for thread in threads:
        thread.start()
    try:
        for _ in range(2 * connections):  # some run and some wait
            assert taken.acquire(timeout=60.0)
        yield
    finally:
        ended.set()
        for thread in threads:
            thread.join()


def numbered(content: bytes) -> Logs:
    """The same log in ever other bytes."""
    numbers = itertools.count(1)
    return lambda: same_grasp(content, next(numbers))


def small_and_many(ramp: GraspLog, frames: int) -> bytes:
    """A log of 2×2 elements and so many frames."""
    times, corner = -(-frames // len(ramp)), np.s_[:, :2, :2]
    displacement, force = (np.tile(field[corner], (times, 1, 1, 1)) for field in (ramp.displacement, ramp.force))  # type: ignore[index]
    time_ = ramp.time[1] * np.arange(times * len(ramp))
    return container.encode(GraspLog(time_, ramp.position[:2, :2], displacement, ramp.element_area, force=force))


class ThreadExecutor:
    """An executor whose long jobs do not end before the attack, and whose short ones are done in a thread."""

    attack_ended = threading.Event()
    missing = None

    def __init__(self, config: worker.StoreConfig, _cpu_seconds: float) -> None:
        self._config = config

    async def start(self) -> None:
        pass

    async def run(self, claim: Claim) -> None:
        if claim.is_long:
            await asyncio.to_thread(self.attack_ended.wait)
        await asyncio.to_thread(worker.run_job, self._config, claim)

    def kill(self) -> None:
        self.attack_ended.set()

    async def close(self) -> None:
        pass


@pytest.mark.long
def test_an_honest_upload_and_its_job_are_done_beside_an_attacker(
    database: Database,
    make: Callable[..., str],
    serving: Serving,
    ramp: GraspLog,
    content: bytes,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(executors, "ProcessExecutor", ThreadExecutor)
    monkeypatch.setattr(worker, "_stores", lambda _: (database, BlobStore(tmp_path)))
    monkeypatch.setattr(ThreadExecutor, "attack_ended", threading.Event())
    monkeypatch.setattr(accept, "LONG_FRAMES", 300)
    honest, long = numbered(content), numbered(small_and_many(ramp, 600))
    own, attackers = make("upload"), make("upload")
    worker.warm_up()  # the kernels may have to be compiled
    with serving(Settings(data_folder=tmp_path, database_url=database.url, access="keys")) as client:
        client.headers["Authorization"] = f"Bearer {own}"
        timed(client, honest())

        @contextmanager
        def attack() -> Iterator[None]:
            ThreadExecutor.attack_ended.clear()
            with flood(str(client.base_url), attackers, long, 2):
                yield
            cancel_all(database)
            ThreadExecutor.attack_ended.set()

        quiet, beside = by_turns(client, honest, attack)
    tolerated = 1.0  # s: server, worker, attackers and caller share one interpreter here
    assert beside.answer < TIMES * quiet.answer + tolerated, (quiet, beside)
    assert beside.job < TIMES * quiet.job + tolerated, (quiet, beside)


def cancel_all(database: Database) -> None:
    with database.write() as session:
        for job_id in session.scalars(select(JobRow.id).where(JobRow.finished_at.is_(None))).all():
            jobs.cancel(session, job_id, "the attack is over")


@pytest.mark.long
def test_so_it_is_with_real_worker_processes(
    database: Database, make: Callable[..., str], ramp: GraspLog, content: bytes, tmp_path: Path
) -> None:
    honest, long = numbered(content), numbered(small_and_many(ramp, 100_000))
    own, attackers = make("upload"), make("upload")
    worker.warm_up()  # kernels that are not compiled yet would be waited for as the server's start
    began = time.monotonic()
    with server(tmp_path, database.url) as client:
        start = time.monotonic() - began  # of a server and its worker process
        client.headers["Authorization"] = f"Bearer {own}"
        timed(client, honest())
        quiet = medians([timed(client, honest()) for _ in range(UPLOADS)])
        with flood(str(client.base_url), attackers, long, 4):
            first = timed(client, honest(), max(JOB_SECONDS, TIMES * (quiet.job + start)))
            beside = medians([timed(client, honest()) for _ in range(UPLOADS)])
    tolerated = 0.2  # s: two looks of a runner at the queue, whatever the quiet time is
    assert first.job < TIMES * (quiet.job + start), (start, quiet, first)  # it waits for one more worker process
    assert beside.answer < TIMES * quiet.answer + tolerated, (quiet, beside)
    assert beside.job < TIMES * quiet.job + tolerated, (quiet, beside)


@contextmanager
def server(folder: Path, database_url: str) -> Iterator[httpx.Client]:
    """A server with its one worker, in processes of their own, once it is ready."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    settings = {"DATA_FOLDER": str(folder / "data"), "DATABASE_URL": database_url, "ACCESS": "keys", "PORT": str(port)}
    environment = os.environ | {f"STICTION_{name}": value for name, value in settings.items()}
    process = subprocess.Popen([sys.executable, "-m", "service.cli", "serve"], env=environment)
    try:
        with httpx.Client(base_url=f"http://127.0.0.1:{port}", timeout=120.0) as client:
            began = time.monotonic()
            while not is_ready(client):
                assert process.poll() is None
                assert time.monotonic() < began + START_SECONDS, "the server is not ready"
                time.sleep(0.02)
            yield client
    finally:
        process.terminate()
        process.wait()


def is_ready(client: httpx.Client) -> bool:
    try:
        return client.get("/readyz").status_code == httpx.codes.OK
    except httpx.TransportError:
        return False
