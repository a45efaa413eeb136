"""What runs in a worker process: module-level functions that take plain values."""

import logging
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from db import identity
from db.blobs import BlobStore, open_blobs
from db.database import Database
from db.errors import BlobDamaged, ClaimLost, StorageUnavailable
from db.records import Claim
from db.repositories import jobs
from service.domain.logs.damage import record_damage
from service.jobs.executor import reason_of
from service.observability import logs
from service.processes import limits

logger = logging.getLogger(__name__)

_OPEN: dict["StoreConfig", tuple[Database, BlobStore]] = {}


@dataclass(frozen=True, slots=True)
class StoreConfig:
    """Where a worker finds its work: database, folder of the blobs and, where they are in one, the object store.

    ``job_memory_bytes``: how much memory a job may take beside what the process had before the first;
    ``scatter_from_other_materials``: whether they show how much grasps of one may differ.
    """

    database_url: str
    data_folder: Path
    blob_url: str | None = None
    blob_cache_bytes: int = 0
    job_memory_bytes: int = 4 * 2**30
    scatter_from_other_materials: bool = True


@cache
def warm_up() -> None:
    """Import and try all that a first job would wait for, once in a process and in those that are forked from it."""
    import estimators
    import slipcore
    from service.jobs import pipeline
    from slipcore.contact import tangential_ramp

    try:
        log = tangential_ramp(points=8, pitch=1.5e-3)
        estimators.fit(slipcore.collect_samples(log, slipcore.detect_slip(log)), method="ols")
        estimators.warm_up()
    except Exception:
        logger.exception("the %s is not warmed up; its first job will be slow", pipeline.__name__)


def run_job(config: StoreConfig, claim: Claim) -> None:
    """Do a job and leave its end in the database; raises ``StorageUnavailable``, for then nobody can write there."""
    with logs.log_context(job=claim.job_id):
        _run(config, claim)


def _run(config: StoreConfig, claim: Claim) -> None:
    from service.jobs import pipeline  # imports the numerics, which the server process does without

    database, blobs = _stores(config)
    try:
        pipeline.prepare(database, claim)
        with limits.memory(config.job_memory_bytes):
            pipeline.run_job(database, blobs, claim, config.scatter_from_other_materials)
    except StorageUnavailable:
        raise
    except ClaimLost as lost:
        logger.warning("%s; what was done of it stays", lost)
    except BlobDamaged as damage:
        record_damage(database, damage, f"job {claim.job_id}")
        with database.write() as session, suppress(ClaimLost):
            jobs.finish(session, claim, "failed", reason=str(damage))
    except MemoryError:
        _refuse(database, claim, f"more than {config.job_memory_bytes} bytes of memory (STICTION_JOB_MEMORY_BYTES)")
    except Exception as error:
        logger.exception("job failed")
        with database.write() as session, suppress(ClaimLost):
            jobs.finish(session, claim, "failed", reason=reason_of(error))


def _refuse(database: Database, claim: Claim, want: str) -> None:
    with database.write() as session, suppress(ClaimLost):
        jobs.refuse_over_limit(session, claim, want)
    logger.warning("job refused: it wants %s", want)


def close_stores() -> None:
    """Close what jobs were done with; the next one opens its stores anew."""
    while _OPEN:
        _OPEN.popitem()[1][0].close()


def _stores(config: StoreConfig) -> tuple[Database, BlobStore]:
    """The stores of a configuration, opened once and kept; raises ``StoreMismatch``."""
    if config not in _OPEN:
        database = Database(config.database_url)
        blobs = open_blobs(config.data_folder, config.blob_url, config.blob_cache_bytes)
        try:
            identity.verify(database, blobs)
        except BaseException:
            database.close()
            raise
        _OPEN[config] = database, blobs
    return _OPEN[config]
