"""Processes are killed at bad moments: what was accepted must end complete exactly once, the rest be gone."""

import json
import os
import signal
import threading
from collections import Counter
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from typing import Any

import httpx
import numpy as np
import pytest
from sqlalchemy import select, text

from db.blobs import BlobStore
from db.database import Database
from db.tables import DetectionRow, RunnerRow
from service.cli.exit_codes import INPUT_REFUSED

KILLS = 300
WRONG_STARTS = 30
"""Of the servers that are killed, how many are first started again with a wrong database."""

KINDS = ("server", "runner", "worker process")
EARLIEST, LATEST = 1e-3, 0.5
"""s from the beginning of an upload to the kill, of which each power of ten is as likely."""

TIMEOUT = 600.0
"""s; only against waiting for ever."""

MOST_UNFINISHED = 3
"""Jobs left when the next upload comes: workers get on, in spite of all the kills."""

Contents = Callable[[int], list[bytes]]


@pytest.mark.parametrize("engine_name", ["sqlite"], indirect=True)
def test_a_server_killed_in_an_upload_and_in_jobs_leaves_all_or_nothing(fleet: Any, contents: Contents) -> None:
    first, second = contents(2)
    server = fleet.serve(workers=1)
    server.make_material()
    accepted = [server.accept(first)]
    sent = int(0.6 * len(second))
    with server.begin_upload(second, sent):
        spool = fleet.folder / "spool"
        fleet.wait_until(
            lambda: any(path.stat().st_size >= sent - 2**20 for path in spool.iterdir()), "the bytes to arrive"
        )
        fleet.kill(fleet.servers[server])  # while the first one's job runs
    fleet.check_consistent()
    assert fleet.stored() == set(accepted)
    fleet.serve(server, workers=1)
    assert list((fleet.folder / "spool").iterdir()) == []
    accepted.append(server.accept(second))
    assert server.accept(first) == accepted[0]
    fleet.check_complete(accepted)


@contextmanager
def nobody_stores_models(database: Database) -> Iterator[None]:
    """Whoever is about to waits until the end, having fitted it."""
    with database.write() as session:
        session.execute(text("SET LOCAL idle_in_transaction_session_timeout = 0"))
        session.execute(text("ALTER SEQUENCE friction_models_id_seq CACHE 1"))  # others wait for their next number
        yield


@pytest.mark.long
@pytest.mark.parametrize("engine_name", ["postgresql"], indirect=True)
def test_the_job_of_a_killed_worker_is_ended_by_another_without_doing_finished_stages_again(
    fleet: Any, contents: Contents
) -> None:
    """Two servers, and two workers one after the other, on one database."""
    server, other = fleet.serve(), fleet.serve()
    server.make_material()
    (content,) = contents(1)
    with ThreadPoolExecutor(2) as pool:  # the same log to both at once is one
        ids = set(pool.map(lambda each: each.accept(content), (server, other)))

    def job() -> Any:
        return other.client.get("/v1/jobs").json()["items"][0]

    with nobody_stores_models(fleet.database):
        worker = fleet.work()
        fleet.wait_until(lambda: job()["stage"] == "friction_model", "the fit to begin")
        fleet.kill(worker)
    before = job()
    assert before["status"] == "running"
    with fleet.database.read() as session:
        (detected,) = session.scalars(select(DetectionRow.created_at))
        (dead,) = session.scalars(select(RunnerRow.id))
    fleet.work()
    fleet.wait_until(fleet.all_ended, "the other worker to end the job")
    after = job()
    assert (after["status"], after["deaths"]) == ("done", 0)
    stages = ("frames", "slip_state", "samples")
    assert [after["seconds"][name] for name in stages] == [before["seconds"][name] for name in stages]
    with fleet.database.read() as session:
        assert session.scalars(select(DetectionRow.created_at)).all() == [detected]
        assert dead not in session.scalars(select(RunnerRow.id)).all()
    fleet.check_complete(ids)


class Campaign:
    """Two servers and two workers, of which one process after the other is killed while logs come in.

    ``killed`` counts the kills of each kind, ``struck`` those of a server in an upload and of a worker in a job,
    ``refused`` the starts with a wrong database.
    """

    def __init__(self, fleet: Any) -> None:
        self.fleet = fleet
        self.rng = np.random.default_rng(1)
        self.accepted: list[str] = []
        self.killed: Counter[str] = Counter()
        self.struck: Counter[str] = Counter()
        self.refused = 0
        for _ in range(2):
            fleet.serve()
            fleet.work()

    def ready(self) -> Any:
        """A server that takes uploads, once there is one and the workers have little left."""
        self.fleet.wait_until(lambda: self.fleet.unfinished() <= MOST_UNFINISHED, "the workers to get on")
        servers = list(self.fleet.servers)
        self.rng.shuffle(servers)
        self.fleet.wait_until(lambda: any(server.is_ready() for server in servers), "a server")
        return next(server for server in servers if server.is_ready())

    def upload_and_kill(self, content: bytes, kind: str) -> None:
        """Start an upload, and kill a process at some moment after that."""
        server = self.ready()
        sender = threading.Thread(target=self.upload, args=(server, content))
        sender.start()
        sender.join(float(EARLIEST * (LATEST / EARLIEST) ** self.rng.uniform()))
        if kind == "server":
            self.struck[kind] += sender.is_alive()
            self.fleet.kill(self.fleet.servers[server])
            if self.killed["server"] * WRONG_STARTS % (KILLS // len(KINDS)) < WRONG_STARTS:
                self.start_with_a_wrong_database(server)
            self.fleet.begin_serving(server)
        else:
            self.kill_worker(kind)
        self.killed[kind] += 1
        sender.join()

    def start_with_a_wrong_database(self, server: Any) -> None:
        """It is refused, while the others work on, and every file stays."""
        before = set(BlobStore(self.fleet.folder).hashes())
        wrong = self.fleet.folder.parent / "wrong.sqlite3"
        self.fleet.begin_serving(server, STICTION_DATABASE_URL=f"sqlite:///{wrong}")
        process = self.fleet.servers.pop(server)
        process.join(TIMEOUT)
        assert process.exitcode == INPUT_REFUSED
        assert set(BlobStore(self.fleet.folder).hashes()) >= before
        self.refused += 1

    def upload(self, server: Any, content: bytes) -> None:
        with suppress(httpx.TransportError):  # killed before its answer
            answer = server.upload(content)
            if answer.status_code == httpx.codes.ACCEPTED:
                self.accepted.append(answer.json()["id"])

    def kill_worker(self, kind: str) -> None:
        """One that has a job, if there is one: the runner with its worker process, or that alone."""
        at_work = self.fleet.at_work()
        runner = max(self.fleet.workers, key=lambda each: (each.pid in at_work, self.rng.uniform()))
        self.struck[kind] += runner.pid in at_work
        if kind == "runner":
            self.fleet.kill(runner)
            self.fleet.work()
            return
        self.fleet.wait_until(lambda: bool(self.fleet.worker_processes(runner.pid)), "a worker process to kill")
        for pid in self.fleet.worker_processes(runner.pid):
            os.kill(pid, signal.SIGKILL)


@pytest.mark.long
def test_processes_killed_at_random_moments_leave_all_or_nothing(fleet: Any, contents: Contents) -> None:
    campaign = Campaign(fleet)
    campaign.ready().make_material()
    logs = contents(KILLS)
    for content, number in zip(logs, campaign.rng.permutation(KILLS), strict=True):
        campaign.upload_and_kill(content, KINDS[number % len(KINDS)])
        fleet.check_consistent()
        assert fleet.stored() >= set(campaign.accepted)
    stored = fleet.stored()
    fleet.check_complete(stored)  # nothing stays of those that were not stored
    server = fleet.serve(workers=1)
    everything = [server.accept(content) for content in logs]
    assert set(everything) > stored >= set(campaign.accepted)
    fleet.check_complete(everything)
    result = {"killed": campaign.killed, "struck": campaign.struck, "accepted": len(campaign.accepted)}
    print(json.dumps(result | {"stored": len(stored), "refused": campaign.refused}))  # noqa: T201  (for docs/long-tests.md)
    assert min(campaign.killed.values()) >= KILLS // len(KINDS)
    assert min(campaign.struck.values()) > KILLS // 20
    assert campaign.refused >= WRONG_STARTS
