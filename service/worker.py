"""What runs in a worker process: module-level functions that take plain values."""

import logging
import multiprocessing
import os
import signal
import threading
from collections.abc import Callable
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from multiprocessing.connection import wait
from pathlib import Path

from db.blobs import BlobStore, open_blobs
from db.database import Database
from db.errors import ClaimLost, StorageUnavailable
from db.records import Claim
from db.repositories import jobs
from service import freed_memory, logs, traces

logger = logging.getLogger(__name__)

NICENESS = 5
"""Of the processes that do jobs: on a busy machine the server gets three times as much of a core as each of them."""


@dataclass(frozen=True, slots=True)
class Place:
    """Where a worker finds its work: database, folder of the blobs and, where they are in one, the object store."""

    database_url: str
    data_folder: Path
    blob_url: str | None = None
    blob_cache_bytes: int = 0


def process(prepare: Callable[[], None] | None = None) -> ProcessPoolExecutor:
    """One process for numerics, or for what else the server keeps out of its own; it begins with ``prepare``."""
    return ProcessPoolExecutor(1, multiprocessing.get_context("spawn"), start, (logs.current(), prepare))


def kill(pool: Executor | None) -> None:
    """End a pool's processes at once, whatever they do (what ``kill_workers`` does from Python 3.14 on)."""
    for process in dict(getattr(pool, "_processes", None) or {}).values():
        process.kill()


def start(chosen: logs.Logs | None, prepare: Callable[[], None] | None = None) -> None:
    """Prepare the process: it ends when the server tells it to or is gone, not by a Ctrl-C meant for the server."""
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    logs.configure(chosen)
    freed_memory.keep()
    traces.start()
    if prepare is not None:
        prepare()


def give_way() -> None:
    """Prepare a process whose work can wait while somebody waits for an answer."""
    os.nice(NICENESS)


def warm_up() -> None:
    """Import and try all that a first job would wait for."""
    import estimators
    import slipcore
    from service import pipeline
    from slipcore.contact import ramp

    try:
        log = ramp.tangential_ramp(points=8, pitch=1.5e-3)
        estimators.fit(slipcore.collect_samples(log, slipcore.detect_slip(log)), method="ols")
        estimators.warm_up()
    except Exception:
        logger.exception("the %s is not warmed up; its first job will be slow", pipeline.__name__)


def run_job(place: Place, claim: Claim) -> None:
    """Do a job and leave its end in the database; raises ``StorageUnavailable``, for then nobody can write there."""
    with logs.about(job=claim.job_id):
        _run(place, claim)


def _run(place: Place, claim: Claim) -> None:
    from service import pipeline  # imports the numerics, which the server process does without

    database, blobs = _stores(place)
    try:
        pipeline.run_job(database, blobs, claim)
    except StorageUnavailable:
        raise
    except ClaimLost as lost:
        logger.warning("%s; what was done of it stays", lost)
    except Exception as error:
        logger.exception("job failed")
        with database.write() as session, suppress(ClaimLost):
            jobs.finish(session, claim, "failed", reason=f"{type(error).__name__}: {error}")


@cache
def _stores(place: Place) -> tuple[Database, BlobStore]:
    return Database(place.database_url), open_blobs(place.data_folder, place.blob_url, place.blob_cache_bytes)


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os._exit(1)  # a worker that waits for work would otherwise wait for ever
