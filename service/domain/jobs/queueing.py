"""Put jobs into the queue, in the transaction of what they are about."""

import logging
from collections.abc import Collection

from sqlalchemy.orm import Session

from db.records import JobKind, JobOrigin
from db.repositories import friction_models, jobs
from service.observability import logs, traces

logger = logging.getLogger(__name__)

INGEST_METHODS = ("auto", "ols")
"""By which an upload's job fits: the recommended method, whose model the job names, and the one that answered before
there was a recommendation, which clients of then still ask for."""

CHEAP_METHODS = frozenset({"ols", "conjugate", "hierarchical"})
"""Methods whose fit is a merge of moments, milliseconds for any logs: by these a material is always fitted again."""


def queue(
    session: Session,
    kind: JobKind,
    method: str,
    *,
    material_id: int | None,
    grasp_log_id: str | None = None,
    seed: int = 0,
    requested_by: str | None,
    is_long: bool = False,
) -> str:
    """Store a job and return its id; the log then has it beside the id of the request that asks for it.

    ``requested_by`` is the id of the access key with which it is asked for, None without one. A fit that is not cheap
    is long in any case.
    """
    job_id = jobs.add(
        session,
        kind,
        method,
        material_id=material_id,
        grasp_log_id=grasp_log_id,
        seed=seed,
        origin=JobOrigin(traces.place(), requested_by),
        is_long=is_long or (kind == "fit" and method not in CHEAP_METHODS),
    )
    logger.info("job queued", extra=logs.of(job=job_id, kind=kind))
    return job_id


def queue_cheap_refits(
    session: Session, material_id: int, requested_by: str | None, besides: Collection[str] = ()
) -> None:
    """Let outdated models of a material be fitted again where that is cheap, and is not queued already.

    ``besides``: methods by which they are in any case.
    """
    for method in friction_models.outdated_methods(session, material_id):
        if method in CHEAP_METHODS.union(besides) and jobs.queued_fit(session, material_id, method) is None:
            queue(session, "fit", method, material_id=material_id, requested_by=requested_by)
