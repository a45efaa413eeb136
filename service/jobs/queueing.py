"""Put jobs into the queue, in the transaction of what they are about."""

import logging

from sqlalchemy.orm import Session

from db.records import JobKind
from db.repositories import jobs
from service.observability import logs, traces

logger = logging.getLogger(__name__)


def queue(
    session: Session,
    kind: JobKind,
    method: str,
    *,
    material_id: int | None,
    grasp_log_id: str | None = None,
    seed: int = 0,
    requested_by: str | None,
) -> str:
    """Store a job and return its id; the log then has it beside the id of the request that asks for it.

    ``requested_by`` is the id of the access key with which it is asked for, None without one.
    """
    job_id = jobs.add(
        session,
        kind,
        method,
        material_id=material_id,
        grasp_log_id=grasp_log_id,
        seed=seed,
        trace=traces.place(),
        requested_by=requested_by,
    )
    logger.info("job queued", extra=logs.of(job=job_id, kind=kind))
    return job_id
