"""The stages in their order: frames → strain → events → slip_state → samples → friction_model → material.

Runs in a worker process. Every step can be done again: what is stored already is not computed twice, and the last
step stores the model and closes the job in one transaction. Whatever is stored is stored under the job's claim: a
worker that was taken for dead, or whose job was cancelled, stores nothing.
"""

import logging
from functools import cache

import slipcore
from db.blobs import BlobStore
from db.database import Database
from db.records import Claim
from db.repositories import grasp_logs, jobs
from estimators import EstimatorError
from service.jobs.find_samples import find_samples
from service.jobs.fit_material import fit_material
from service.jobs.run import InsufficientData, Run
from service.observability import logs, traces
from slipcore import SlipcoreError

logger = logging.getLogger(__name__)


def prepare(database: Database, claim: Claim) -> None:
    """Load the kernels that a job needs: their compiler ends the whole process where memory is at its limit."""
    with database.read() as session:
        job = jobs.get(session, claim.job_id)
        if job.grasp_log_id is not None:
            _load_kernels(grasp_logs.get(session, job.grasp_log_id).detector)


@cache
def _load_kernels(detector: str) -> None:
    slipcore.warm_up(detector)


def run_job(database: Database, blobs: BlobStore, claim: Claim, scatter_from_other_materials: bool = True) -> None:
    """Do a job to its end: done, or refused where the data do not allow it (or no chain of theirs converges).

    Raises ``ClaimLost`` once it is not this runner's any more.
    """
    with database.read() as session:
        job = jobs.get(session, claim.job_id)
    run = Run(database, blobs, claim, job, dict(job.seconds), scatter_from_other_materials)
    logs.note(kind=job.kind)
    try:
        with traces.span(job.kind, job.trace, job=job.id):
            _take_through_the_stages(run)
    except (InsufficientData, SlipcoreError, EstimatorError) as refusal:
        with database.write() as session:
            jobs.finish(session, claim, "refused", reason=str(refusal), seconds=run.seconds)
        logger.info("job refused: %s", refusal, extra=logs.of(seconds=run.total))
    else:
        logger.info("job done", extra=logs.of(seconds=run.total))


def _take_through_the_stages(run: Run) -> None:
    job = run.job
    samples = None if job.grasp_log_id is None else find_samples(run, job.grasp_log_id)
    if job.material is None:  # detection only
        with run.database.write() as session:
            jobs.finish(session, run.claim, "done", seconds=run.seconds)
        return
    if samples is not None and samples.none_because is not None:
        raise InsufficientData(samples.none_because)
    fit_material(run)
