"""Queries on jobs: durable rows that a restarted service takes up again."""

import uuid
from collections.abc import Mapping

from sqlalchemy import select, update
from sqlalchemy.orm import Session

from db.errors import NotFound
from db.records import Job, JobKind, JobStatus
from db.tables import JobRow, MaterialRow, now


def add(
    session: Session,
    kind: JobKind,
    method: str,
    *,
    material_id: int | None,
    grasp_log_id: str | None = None,
    seed: int = 0,
) -> str:
    """Store a queued job and return its id."""
    row = JobRow(
        id=uuid.uuid4().hex,
        kind=kind,
        status="queued",
        method=method,
        material_id=material_id,
        grasp_log_id=grasp_log_id,
        seed=seed,
        seconds={},
    )
    session.add(row)
    session.flush()
    return row.id


def get(session: Session, job_id: str) -> Job:
    """One job; raises ``NotFound``."""
    query = select(JobRow, MaterialRow.name).outerjoin(MaterialRow).where(JobRow.id == job_id)
    row = session.execute(query).one_or_none()
    if row is None:
        raise NotFound("job", job_id)
    return record(*row)


def unfinished(session: Session) -> list[str]:
    """Ids of the jobs that are queued or were running, oldest first."""
    query = select(JobRow.id).where(JobRow.status.in_(("queued", "running"))).order_by(JobRow.created_at, JobRow.id)
    return list(session.scalars(query))


def move_unfinished(session: Session, source_id: int, target_id: int) -> None:
    """Let the jobs that a material still has be about another one."""
    of_it = (JobRow.material_id == source_id, JobRow.status.in_(("queued", "running")))
    session.execute(update(JobRow).where(*of_it).values(material_id=target_id))


def start_stage(session: Session, job_id: str, stage: str, seconds: Mapping[str, float]) -> None:
    """Say that the job runs and in which stage; ``seconds`` are those of the stages done."""
    _change(session, job_id, status="running", stage=stage, seconds=dict(seconds))


def requeue(session: Session, job_id: str) -> None:
    """Put a job back into the queue, as if it had just been added."""
    _change(session, job_id, status="queued", stage=None, reason=None, deaths=0, finished_at=None)


def count_death(session: Session, job_id: str) -> Job:
    """Count a worker that died under the job and put the job back into the queue."""
    _change(session, job_id, status="queued", deaths=JobRow.deaths + 1)
    return get(session, job_id)


def finish(
    session: Session,
    job_id: str,
    status: JobStatus,
    *,
    reason: str | None = None,
    model_version: int | None = None,
    seconds: Mapping[str, float] | None = None,
) -> None:
    """Close a job as done, failed or refused; a failed or refused one keeps the stage in which it ended."""
    changes: dict[str, object] = {"status": status, "reason": reason, "model_version": model_version}
    if status == "done":
        changes["stage"] = None
    if seconds is not None:
        changes["seconds"] = dict(seconds)
    _change(session, job_id, finished_at=now(), **changes)


def record(row: JobRow, material: str | None) -> Job:
    """The row as a plain record."""
    return Job(
        id=row.id,
        kind=row.kind,  # type: ignore[arg-type]  # the database checks it
        status=row.status,  # type: ignore[arg-type]
        stage=row.stage,
        reason=row.reason,
        seconds=row.seconds,
        grasp_log_id=row.grasp_log_id,
        material=material,
        method=row.method,
        seed=row.seed,
        deaths=row.deaths,
        model_version=row.model_version,
        created_at=row.created_at,
        finished_at=row.finished_at,
    )


def _change(session: Session, job_id: str, **values: object) -> None:
    session.execute(update(JobRow).where(JobRow.id == job_id).values(**values))
