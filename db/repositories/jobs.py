"""Queries on jobs: durable rows that runners claim. Only the runner that has the claim can change a running job."""

import uuid
from collections.abc import Collection, Mapping
from datetime import datetime
from typing import cast

from sqlalchemy import ColumnElement, Select, false, func, select, update
from sqlalchemy.orm import Session

from db.errors import ClaimLost, NotFound
from db.paging import Window, windowed
from db.records import Claim, Job, JobKind, JobOrigin, JobStatus
from db.repositories import copies, friction_models, materials_of_logs, turns
from db.tables import FrictionModelRow, GraspLogRow, JobRow, MaterialRow, SampleSummaryRow, now


def add(
    session: Session,
    kind: JobKind,
    method: str,
    *,
    material_id: int | None,
    grasp_log_id: str | None = None,
    seed: int = 0,
    origin: JobOrigin | None = None,
    is_long: bool = False,
) -> str:
    """Store a queued job and return its id; one that ``is_long`` lets more of others go before it."""
    origin = origin or JobOrigin()
    row = JobRow(
        id=uuid.uuid4().hex,
        kind=kind,
        status="queued",
        method=method,
        material_id=material_id,
        grasp_log_id=grasp_log_id,
        seed=seed,
        seconds={},
        trace=origin.trace,
        requested_by=origin.requested_by,
        is_long=is_long,
        **turns.new(session, origin.requested_by, material_id, is_long=is_long),
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


def material_id(session: Session, job_id: str) -> int:
    """The key of the material that a job is about, whatever its name is by now; raises ``NotFound`` for a job of none.

    Of a job under way it is the one that its material was merged into.
    """
    found = session.scalar(select(JobRow.material_id).where(JobRow.id == job_id))
    if found is None:
        raise NotFound("job of a material", job_id)
    return found


def list_all(session: Session, window: Window, status: JobStatus | None = None) -> list[Job]:
    """Jobs of one status, or all."""
    query = select(JobRow, MaterialRow.name).outerjoin(MaterialRow)
    if status is not None:
        query = query.where(JobRow.status == status)
    found = session.execute(windowed(query, window, {"created_at": JobRow.created_at}, JobRow.id))
    return [record(*row) for row in found]


def newest_ingest(session: Session, material_id: int) -> tuple[JobStatus, str | None] | None:
    """How the newest log of a material that was not withdrawn fared, and why it ended so; None where there is none."""
    query = select(JobRow.status, JobRow.reason).join(GraspLogRow, GraspLogRow.id == JobRow.grasp_log_id)
    query = query.where(GraspLogRow.material_id == material_id, GraspLogRow.withdrawn_at.is_(None))
    row = session.execute(query.order_by(GraspLogRow.number.desc(), GraspLogRow.id.desc()).limit(1)).first()
    return None if row is None else (cast(JobStatus, row.status), row.reason)


def move_unfinished(session: Session, source_id: int, target_id: int) -> None:
    """Let the jobs that a material still has be about another one."""
    of_it = (JobRow.material_id == source_id, JobRow.status.in_(("queued", "running")))
    session.execute(update(JobRow).where(*of_it).values(material_id=target_id))


def count_unfinished(session: Session) -> dict[str, int]:
    """How many jobs are queued, and how many running."""
    unfinished = ("queued", "running")
    query = select(JobRow.status, func.count()).where(JobRow.status.in_(unfinished)).group_by(JobRow.status)
    return dict.fromkeys(unfinished, 0) | {str(row[0]): int(row[1]) for row in session.execute(query)}


def ended_since(session: Session, moment: datetime) -> list[Job]:
    """Jobs that ended at this moment or later, the first ones first."""
    query = select(JobRow, MaterialRow.name).outerjoin(MaterialRow).where(JobRow.finished_at >= moment)
    return [record(*row) for row in session.execute(query.order_by(JobRow.finished_at))]


def queued_fit(session: Session, material_id: int, method: str) -> str | None:
    """Id of a fit of this material by this method that no runner takes before the end of the transaction, if any."""
    same = (JobRow.material_id == material_id, JobRow.status == "queued", JobRow.kind == "fit", JobRow.method == method)
    return session.scalar(select(JobRow.id).where(*same).limit(1).with_for_update())


def any_queued(session: Session, *, only_short: bool = False) -> bool:
    """Whether a job waits for a runner."""
    wanted = (JobRow.status == "queued", *_of_size(only_short=only_short))
    return session.scalar(select(JobRow.id).where(*wanted).limit(1)) is not None


def claim(session: Session, runner_id: str, besides: Collection[str] = (), *, only_short: bool = False) -> Claim | None:
    """Give the queued job whose turn it is to a runner, if there is one; runners that claim at once get different ones.

    ``besides``: jobs that the runner is still at, whatever a database that crashed remembers of its claims.
    """
    found = turns.first(session, JobRow.id.not_in(besides), *_of_size(only_short=only_short))
    if found is None:
        return None
    job_id, turn = found
    # once: of a row that is changed again PostgreSQL asks for the material anew, which a merge may hold
    claimed = update(JobRow).where(JobRow.id == job_id).values(status="running", runner_id=runner_id, turn=turn)
    is_long = session.scalar(claimed.returning(JobRow.is_long))
    return Claim(job_id, runner_id, bool(is_long))


def _of_size(*, only_short: bool) -> tuple[ColumnElement[bool], ...]:
    return (JobRow.is_long == false(),) if only_short else ()


def claimed(session: Session, runner_id: str) -> set[str]:
    """Ids of the jobs that a runner is at."""
    return set(session.scalars(select(JobRow.id).where(JobRow.runner_id == runner_id)))


def start_stage(session: Session, claim: Claim, stage: str, seconds: Mapping[str, float]) -> None:
    """Say in which stage a job is; ``seconds`` are those of the stages done. Raises ``ClaimLost``.

    Until the end of the transaction nobody can take the job away.
    """
    _change_claimed(session, claim, stage=stage, seconds=dict(seconds))


def hold(session: Session, job_id: str) -> str:
    """The status of a job, which nobody takes up or ends until the transaction ends."""
    return session.execute(select(JobRow.status).where(JobRow.id == job_id).with_for_update()).scalar_one()


def requeue(session: Session, job_id: str, requested_by: str | None = None) -> None:
    """Put a job that has ended back into the queue, as if it had just been added; nothing happens to another.

    One of a log is about the material that the log is of by now, which may have been merged.
    """
    changes = {"status": "queued", "stage": None, "reason": None, "deaths": 0, "finished_at": None}
    row = session.get_one(JobRow, job_id)
    log = None if row.grasp_log_id is None else session.get_one(GraspLogRow, row.grasp_log_id)
    _leave_models(session, row)
    material_id = row.material_id if log is None else log.material_id
    changes |= {"requested_by": requested_by, "material_id": material_id}
    changes |= turns.new(session, requested_by, material_id, is_long=row.is_long)
    session.execute(update(JobRow).where(JobRow.id == job_id, JobRow.finished_at.is_not(None)).values(**changes))


def _leave_models(session: Session, job: JobRow) -> None:
    """Give the models of a job that is done again to a fit that has ended as it has: a job has one by each method."""
    made = FrictionModelRow.job_id == job.id
    if job.finished_at is None or session.scalar(select(FrictionModelRow.id).where(made).limit(1)) is None:
        return
    past = JobRow(id=uuid.uuid4().hex, kind="fit")
    for name in ("status", "reason", "method", "material_id", "seed", "model_version", "trace", "requested_by"):
        setattr(past, name, getattr(job, name))
    past.seconds, past.created_at, past.finished_at = dict(job.seconds), job.created_at, job.finished_at
    session.add(past)
    session.flush()
    session.execute(update(FrictionModelRow).where(made).values(job_id=past.id))


def release(session: Session, claim: Claim) -> None:
    """Put a job that a runner cannot go on with back into the queue; raises ``ClaimLost``."""
    _change_claimed(session, claim, status="queued", runner_id=None)


def release_all(session: Session, runner_id: str) -> list[str]:
    """Put every job of a runner back into the queue; returns their ids."""
    freed = update(JobRow).where(JobRow.runner_id == runner_id).values(status="queued", runner_id=None)
    return list(session.scalars(freed.returning(JobRow.id)))


def count_death(session: Session, claim: Claim) -> Job:
    """Count a worker process that died under the job; raises ``ClaimLost``."""
    _change_claimed(session, claim, deaths=JobRow.deaths + 1)
    return get(session, claim.job_id)


def cancel(session: Session, job_id: str, reason: str) -> Job:
    """End a job that has not ended yet: whoever is at it finds its claim lost. Raises ``NotFound``.

    Models of its material that lack its samples say so.
    """
    _hold_material(session, job_id)
    changes = {"status": "cancelled", "reason": reason, "runner_id": None, "finished_at": now()}
    ended = update(JobRow).where(JobRow.id == job_id, JobRow.finished_at.is_(None)).values(**changes)
    if session.scalar(ended.returning(JobRow.id)) is not None:
        _account_for(session, job_id)
    return get(session, job_id)


def finish(
    session: Session,
    claim: Claim,
    status: JobStatus,
    *,
    reason: str | None = None,
    model_version: int | None = None,
    seconds: Mapping[str, float] | None = None,
) -> None:
    """Close a job as done, failed or refused; a failed or refused one keeps the stage in which it ended.

    Where it made no model, those of its material that lack its samples say so. Raises ``ClaimLost``.
    """
    if status != "done":
        _hold_material(session, claim.job_id)
    changes: dict[str, object] = {"status": status, "reason": reason, "model_version": model_version}
    if status == "done":
        changes["stage"] = None
    if seconds is not None:
        changes["seconds"] = dict(seconds)
    _change_claimed(session, claim, runner_id=None, finished_at=now(), **changes)
    if status != "done":
        _account_for(session, claim.job_id)


def outdate_models(session: Session, job_id: str, besides: Collection[str] = ()) -> None:
    """Say of a material's models, but those by the methods ``besides``, that they lack the samples which a job stored.

    They do not where its log was withdrawn meanwhile; who withdraws it now waits for the rows that refer to it.
    """
    of_it = _material_of_log(job_id).join(SampleSummaryRow, SampleSummaryRow.grasp_log_id == GraspLogRow.id)
    material_id = session.scalar(of_it.where(SampleSummaryRow.count > 0, GraspLogRow.withdrawn_at.is_(None)))
    if material_id is not None:
        friction_models.mark_outdated(session, material_id, besides)


def refuse_over_limit(session: Session, claim: Claim, want: str) -> None:
    """Refuse a job that wants more than it may have, and say in which stage; raises ``ClaimLost``."""
    stage = get(session, claim.job_id).stage or "first"
    finish(session, claim, "refused", reason=f"stage {stage} wants {want}")


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
        trace=row.trace,
        requested_by=row.requested_by,
        created_at=row.created_at,
        finished_at=row.finished_at,
    )


def _account_for(session: Session, job_id: str) -> None:
    """Let the material of a job that has ended, but not as done, count its log's samples, or those of a copy of it."""
    outdate_models(session, job_id)
    row = session.get_one(JobRow, job_id)
    copy_id = None if row.grasp_log_id is None else copies.stand_in(session, row.grasp_log_id)
    if copy_id is not None:
        outdate_models(session, session.scalars(select(JobRow.id).where(JobRow.grasp_log_id == copy_id)).one())


def _hold_material(session: Session, job_id: str) -> None:
    """Hold the material of a job's log, if it has one, before the job: who stores samples or merges does so, too."""
    log_id = session.scalar(select(JobRow.grasp_log_id).where(JobRow.id == job_id))
    if log_id is not None:
        materials_of_logs.hold(session, log_id)


def _material_of_log(job_id: str) -> Select[int | None]:
    return (
        select(GraspLogRow.material_id).join(JobRow, JobRow.grasp_log_id == GraspLogRow.id).where(JobRow.id == job_id)
    )


def _change_claimed(session: Session, claim: Claim, **values: object) -> None:
    mine = (JobRow.id == claim.job_id, JobRow.runner_id == claim.runner_id)
    if session.scalar(update(JobRow).where(*mine).values(**values).returning(JobRow.id)) is None:
        raise ClaimLost(claim.job_id)
