import asyncio
import multiprocessing
import os
import shutil
import signal
import threading
import time
from collections.abc import Callable
from contextlib import AbstractContextManager, closing
from pathlib import Path
from typing import Any

import httpx
import pytest
from sqlalchemy import delete, update

import estimators
import slipcore
from db import migrate
from db.blobs import BlobStore
from db.database import Database
from db.errors import SchemaMismatch
from db.repositories import jobs
from db.tables import FrictionModelRow, JobRow
from service.app import create_app, running
from service.jobs.process_executor import ProcessExecutor
from service.settings import Settings
from slipcore.contact.tiers.ramp import tangential_ramp
from stiction_client.container import encode

Serving = Callable[[Settings], AbstractContextManager[httpx.Client]]
Upload = Callable[..., httpx.Response]
Wait = Callable[[httpx.Client, str], dict[str, Any]]


async def start_and_stop(settings: Settings) -> None:
    async with running(settings):
        pass


def test_two_servers_share_a_folder_and_only_one_that_is_alone_clears_what_was_under_way(
    serving: Serving, tmp_path: Path, upload: Upload, content: bytes
) -> None:
    settings = Settings(data_folder=tmp_path, workers=0)
    with serving(settings) as client:
        log = upload(client, content).raise_for_status().json()
        left = tmp_path / "spool" / "under way"
        left.write_bytes(b"half an upload")
        with serving(settings) as other:
            assert other.get(f"/v1/grasp-logs/{log['id']}").json() == log
            assert left.exists()
    asyncio.run(start_and_stop(settings))
    assert not left.exists()


def test_a_server_is_ready_once_its_workers_are_warm(
    serving: Serving, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    warm = threading.Event()

    async def start(_: ProcessExecutor) -> None:
        await asyncio.to_thread(warm.wait)

    monkeypatch.setattr(ProcessExecutor, "start", start)
    with serving(Settings(data_folder=tmp_path)) as client:
        cold = client.get("/readyz")
        assert (cold.status_code, cold.json()["type"]) == (503, "/problems/workers-not-ready")
        assert cold.json()["detail"] == "1 of 1 workers warm up"
        assert client.get("/healthz").status_code == httpx.codes.OK
        warm.set()
        while client.get("/readyz").status_code != httpx.codes.OK:
            time.sleep(0.001)


def test_an_old_schema_stops_the_start_where_it_must_not_be_changed(tmp_path: Path) -> None:
    with pytest.raises(SchemaMismatch, match="stiction db upgrade"):
        asyncio.run(start_and_stop(Settings(data_folder=tmp_path, migrate_at_start=False)))


def test_a_start_brings_the_schema_up_and_leaves_every_file(tmp_path: Path) -> None:
    settings = Settings(data_folder=tmp_path, workers=0)
    asyncio.run(start_and_stop(settings))
    blobs = BlobStore(tmp_path)
    orphan = blobs.put(b"stored, but the server died before its row was")
    (tmp_path / "spool" / "left").write_bytes(b"half an upload")
    asyncio.run(start_and_stop(settings))
    assert list(blobs.hashes()) == [orphan]
    assert not list((tmp_path / "spool").iterdir())
    with closing(Database(settings.resolved_database_url)) as database:
        assert migrate.current(database) == migrate.head()


def test_a_job_whose_worker_is_killed_is_done_by_the_next_one(
    client: httpx.Client, served: Settings, material: str, upload: Upload, wait: Wait
) -> None:
    content = encode(tangential_ramp(points=12, marker_noise=1e-6))
    wait(client, upload(client, content).json()["job"]["id"])  # the worker is warm
    job = upload(client, content, material=material).json()["job"]["id"]
    while client.get(f"/v1/jobs/{job}").json()["stage"] is None:
        time.sleep(0.001)
    for process in multiprocessing.active_children():  # another server of this process may have its own
        assert process.pid is not None
        os.kill(process.pid, signal.SIGKILL)
    done = wait(client, job)
    assert (done["status"], done["model_version"]) == ("done", 1)
    fits = client.get(f"/v1/materials/{material}/fits").json()["items"]
    assert [(fit["method"], fit["version"]) for fit in fits] == [("ols", 1), ("hierarchical", 1)]
    with closing(Database(served.resolved_database_url)) as database, database.read() as session:
        assert jobs.get(session, job).deaths == 1


def test_no_numerics_run_in_the_server_process(
    client: httpx.Client, material: str, content: bytes, upload: Upload, wait: Wait, monkeypatch: pytest.MonkeyPatch
) -> None:
    def here(*_: object, **__: object) -> None:
        raise AssertionError("numerics in the server process")

    for module, name in ((slipcore, "detect_slip"), (slipcore, "collect_friction"), (estimators, "fit")):
        monkeypatch.setattr(module, name, here)
    assert wait(client, upload(client, content, material=material).json()["job"]["id"])["status"] == "done"


def test_a_log_whose_job_failed_gets_another_try_when_it_is_sent_again(
    client: httpx.Client, served: Settings, material: str, content: bytes, upload: Upload, wait: Wait
) -> None:
    first = upload(client, content, material=material).json()
    assert wait(client, first["job"]["id"])["status"] == "done"
    database = Database(served.resolved_database_url)
    failed = {"status": "failed", "reason": "the worker process died 3 times"}
    with database.write() as session:  # as if the job had failed before it stored its model
        session.execute(delete(FrictionModelRow).where(FrictionModelRow.job_id == first["job"]["id"]))
        session.execute(update(JobRow).where(JobRow.id == first["job"]["id"]).values(failed))
    database.close()
    again = upload(client, content, material=material)
    assert (again.status_code, again.json()["job"]["status"]) == (200, "queued")
    assert again.json()["id"] == first["id"]
    assert wait(client, first["job"]["id"])["reason"] is None


def test_without_settings_those_of_the_environment_hold(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("STICTION_PORT", "99999")
    with pytest.raises(ValueError, match="port"):
        create_app()


def test_uploads_and_results_are_kept_in_an_object_store(
    s3: Any, serving: Any, content: bytes, upload: Any, wait: Any, tmp_path: Path
) -> None:
    with serving(Settings(data_folder=tmp_path, blob_url="s3://grasps/lab", blob_cache_bytes=0)) as client:
        client.post("/v1/materials", json={"name": "paper"}).raise_for_status()
        accepted = upload(client, content, material="paper").json()
        assert accepted["sha256"] in {key.rpartition("/")[2] for key in s3.objects}
        assert wait(client, accepted["job"]["id"])["status"] == "done"
        assert len(s3.objects) == 4  # the log, its history, its samples, and the store's id
        shutil.rmtree(tmp_path / "blobs")  # but a cache
        (tmp_path / "blobs").mkdir()
        log = f"/v1/grasp-logs/{accepted['id']}"
        assert client.get(f"{log}/file").content == content
        assert client.get(f"{log}/samples").json()["normal_force"]
