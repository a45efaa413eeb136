"""Jobs on a Dask cluster of real processes."""

import asyncio
import os
import signal
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from db.blobs import BlobStore
from db.database import Database
from db.records import Claim, NewGraspLog
from db.repositories import grasp_logs, jobs, materials
from service.worker import Place

pytest.importorskip("distributed")

from service.dask_lane import DaskLane
from service.lanes import WorkerDied


@pytest.fixture
def cluster() -> Iterator[Any]:
    from distributed import LocalCluster

    with LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address=None) as cluster:
        yield cluster


@pytest.fixture
def mine(database: Database, blobs: BlobStore, content: bytes, claim: Callable[[], Claim]) -> Claim:
    with database.write() as session:
        material_id = materials.create(session, "paper", "").id
        log = NewGraspLog(blobs.put(content), len(content), "npz", "filter", material_id, "s", 82, 2.7, (8, 8))
        log_id = grasp_logs.add(session, log)
        jobs.add(session, "ingest", "ols", material_id=material_id, grasp_log_id=log_id)
    return claim()


@pytest.mark.long
@pytest.mark.parametrize("engine_name", ["sqlite"], indirect=True)
@pytest.mark.filterwarnings("default")  # the cluster's own
def test_a_cluster_does_jobs_and_says_when_it_is_gone(
    database: Database, tmp_path: Path, mine: Claim, cluster: Any
) -> None:
    async def work() -> None:
        lane = DaskLane(Place(database.url, tmp_path), cluster.scheduler_address)
        await lane.hire()
        (pid,) = {nanny.pid for nanny in cluster.workers.values()}
        running = asyncio.ensure_future(lane.run(mine))
        await asyncio.sleep(0.02)
        os.kill(pid, signal.SIGKILL)  # the cluster starts another worker, which goes on
        await running
        later = asyncio.ensure_future(lane.run(Claim("none", mine.runner_id)))
        await asyncio.to_thread(cluster.close)
        with pytest.raises((WorkerDied, LookupError)):
            await later
        await lane.close()

    asyncio.run(work())
    with database.read() as session:
        assert (jobs.get(session, mine.job_id).status, jobs.get(session, mine.job_id).model_version) == ("done", 1)
