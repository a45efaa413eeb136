"""Jobs on a real Dask cluster: its scheduler and its workers are processes of their own."""

import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, ExitStack, closing
from pathlib import Path
from typing import Any

import httpx
import pytest

from db.database import Database
from db.errors import DriverMissing
from db.repositories import jobs
from service.jobs import campaign
from service.jobs.executors import executors
from service.jobs.worker import StoreConfig
from service.settings import Settings
from slipcore.contact import Scene
from slipcore.errors import InvalidInput
from tests.waiting import wait_until

ROOT = Path(__file__).parents[2]
Serving = Callable[[Settings], AbstractContextManager[httpx.Client]]


class Cluster:
    """A scheduler on a loopback port, and workers that join it."""

    def __init__(self, folder: Path) -> None:
        with closing(socket.create_server(("127.0.0.1", 0))) as listening:
            self.address = f"tcp://127.0.0.1:{listening.getsockname()[1]}"
        self._folder = folder
        self._processes: list[subprocess.Popen[bytes]] = []

    def start_scheduler(self) -> subprocess.Popen[bytes]:
        return self._start("scheduler", "--host", self.address)

    def start_worker(self) -> subprocess.Popen[bytes]:
        options = ["--nthreads", "1", "--no-nanny", "--local-directory", str(self._folder)]
        return self._start("worker", self.address, *options)

    def has_work(self) -> bool:
        """Whether a worker has been told to do something."""
        with self._client() as client:
            return any(client.processing().values())

    def is_idle(self) -> bool:
        """Whether the results of all that was done have been fetched from the workers, too."""
        with self._client() as client:
            return not client.who_has()

    def _client(self) -> Any:
        from distributed import Client  # takes half a second to load

        return Client(self.address, set_as_default=False)

    def _start(self, what: str, *options: str) -> subprocess.Popen[bytes]:
        command = [sys.executable, "-m", f"distributed.cli.dask_{what}", *options, "--no-dashboard"]
        path = os.pathsep.join((str(ROOT), str(ROOT / "clients")))
        with (self._folder / f"{what}.log").open("ab") as log:
            process = subprocess.Popen(command, stdout=log, stderr=log, env=os.environ | {"PYTHONPATH": path})
        self._processes.append(process)
        return process

    def end(self) -> None:
        for process in self._processes:
            process.kill()
            process.wait()


@pytest.fixture
def cluster(tmp_path: Path) -> Iterator[Cluster]:
    cluster = Cluster(tmp_path)
    yield cluster
    cluster.end()


@pytest.fixture
def settings(cluster: Cluster, tmp_path: Path) -> Settings:
    return Settings(data_folder=tmp_path / "data", dask_address=cluster.address, shutdown_seconds=0.0)


def deaths(settings: Settings, job: str) -> int:
    with closing(Database(settings.resolved_database_url)) as database, database.read() as session:
        return jobs.get(session, job).deaths


@pytest.mark.long
def test_jobs_are_done_on_a_cluster_whose_workers_and_whose_scheduler_die(
    cluster: Cluster, settings: Settings, serving: Serving, content: bytes, upload: Any, wait: Any
) -> None:
    scheduler, first = cluster.start_scheduler(), cluster.start_worker()
    with ExitStack() as running:
        client = running.enter_context(serving(settings))
        wait_until(lambda: client.get("/readyz").status_code == httpx.codes.OK, "the server to be ready")
        client.post("/v1/materials", json={"name": "paper"}).raise_for_status()

        job = upload(client, content, material="paper").json()["job"]["id"]
        assert wait(client, job)["model_version"] == 1

        wait_until(cluster.is_idle, "the job to end")
        first.send_signal(signal.SIGSTOP)  # so that it dies with the job and not after it
        job = client.post("/v1/materials/paper/fits", json={"method": "ols"}).json()["id"]
        wait_until(cluster.has_work, "the job to begin")
        second = cluster.start_worker()
        first.kill()
        assert wait(client, job)["status"] == "done"
        assert deaths(settings, job) == 0

        wait_until(cluster.is_idle, "the job to end")
        second.send_signal(signal.SIGSTOP)
        job = client.post("/v1/materials/paper/fits", json={"method": "ols"}).json()["id"]
        wait_until(cluster.has_work, "the job to begin")
        scheduler.kill()
        wait_until(lambda: client.get(f"/v1/jobs/{job}").json()["status"] == "queued", "the job to wait again")
        wait_until(lambda: client.get("/readyz").status_code == httpx.codes.SERVICE_UNAVAILABLE, "the server to say so")
        began = time.monotonic()
        running.close()
        assert time.monotonic() - began < 30.0  # not for ever


@pytest.mark.long
def test_a_campaign_runs_on_a_cluster(cluster: Cluster, tmp_path: Path) -> None:
    cluster.start_scheduler()
    cluster.start_worker()
    sampling = {"kind": "SensorSampling", "frame_rate": 3.0, "points": [4, 4]}
    scene = Scene.from_mapping({"name": "press", "effect": [sampling]})
    with campaign.workers(1, cluster.address) as executor:
        made = list(campaign.run(executor, [scene], range(2), tmp_path / "logs", campaign.RequestedAccuracy()))
    assert [outcome.refused for outcome in made] == [None, None]
    assert {path.name for path in (tmp_path / "logs").glob("*.npz")} == {"press-0.npz", "press-1.npz"}


def test_a_campaign_names_a_scheduler_that_is_not_there(cluster: Cluster, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(campaign, "CONNECT_SECONDS", 0.5)
    named = pytest.raises(InvalidInput, match=r"Dask address is .*; allowed: one at which a scheduler answers")
    with named, campaign.workers(1, cluster.address):
        pass


@pytest.mark.parametrize("address", ["", "nonsense", "tcp://", "foo://there:1"])
def test_an_address_that_is_none_is_refused_before_there_is_a_client(
    address: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("distributed.Client", lambda *_, **__: pytest.fail("its end waits 20 s, and fails"))
    with pytest.raises(InvalidInput, match="Dask address is"), campaign.workers(1, address):
        pass


def test_a_scheduler_that_is_not_there_is_named_and_holds_no_stop_up(
    cluster: Cluster, settings: Settings, serving: Serving, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("service.jobs.dask_executor.CONNECT_SECONDS", 0.5)
    with ExitStack() as running:
        client = running.enter_context(serving(settings.model_copy(update={"shutdown_seconds": 60.0})))
        wait_until(
            lambda: f"{cluster.address} does not answer" in client.get("/readyz").json()["detail"],
            "the server to say so",
        )
        began = time.monotonic()
        running.close()
        assert time.monotonic() - began < 30.0  # not for ever


def test_without_its_library_the_extra_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    monkeypatch.delitem(sys.modules, "service.jobs.dask_executor", raising=False)
    with pytest.raises(DriverMissing, match=r"Dask cluster is tcp://a:1, .* \(stiction\[dask\] brings one\)"):
        executors(StoreConfig("sqlite:///x", tmp_path), 1, "tcp://a:1", 300.0)
    with pytest.raises(DriverMissing, match=r"Dask cluster is tcp://a:1, "), campaign.workers(1, "tcp://a:1"):
        pass
