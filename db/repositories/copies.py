"""Copies of one log, alike in content and detector, that a merge of materials brings together.

The one that stays with the material counts, those left behind with the merged-away ones do not: the copy with samples
is to be the one that stays.
"""

import uuid
from collections.abc import Sequence

from sqlalchemy import ColumnElement, and_, case, func, select
from sqlalchemy.orm import Session, aliased

from db.tables import GraspLogRow, JobRow, MaterialRow, SampleSummaryRow

_OWN, _COPY = aliased(GraspLogRow), aliased(GraspLogRow)
_OWN_JOB, _COPY_JOB = aliased(JobRow), aliased(JobRow)
_OWN_SAMPLES, _COPY_SAMPLES = aliased(SampleSummaryRow), aliased(SampleSummaryRow)


def exchange(session: Session, material_id: int, other_id: int) -> None:
    """Let copies in another material change places with a material's own that lack the samples, or the latest ones."""
    _change_places(session, _better(session, _OWN.material_id == material_id, _COPY.material_id == other_id))


def stand_in(session: Session, log_id: str) -> str | None:
    """Let a copy that a merge left behind take the place of a log whose job has ended without samples.

    Returns the copy's id, if there is one.
    """
    left_behind = select(MaterialRow.id).where(MaterialRow.merged_into_id == _OWN.material_id)
    found = _better(session, _OWN.id == log_id, _COPY.material_id.in_(left_behind))[:1]
    _change_places(session, found)
    return found[0][1].id if found else None


def _better(session: Session, *of_these: ColumnElement[bool]) -> list[tuple[GraspLogRow, GraspLogRow]]:
    """Logs whose job has ended, each with a copy that has samples where it has none, may find some, or has other ones.

    Neither is withdrawn. Of two jobs that were done, the later one counts: the sensor may have been described anew.
    """
    own_has, copy_has = (func.coalesce(each.count, 0) > 0 for each in (_OWN_SAMPLES, _COPY_SAMPLES))
    is_newer = _COPY_JOB.finished_at > _OWN_JOB.finished_at
    was_not_done = _OWN_JOB.status.in_(("failed", "cancelled"))
    instead = copy_has & (is_newer | was_not_done) | _COPY_JOB.finished_at.is_(None)
    others = copy_has & is_newer & (_COPY_SAMPLES.samples_blob != _OWN_SAMPLES.samples_blob)
    query = (
        select(_OWN, _COPY)
        .join(_COPY, and_(_COPY.sha256 == _OWN.sha256, _COPY.detector == _OWN.detector))
        .join(_OWN_JOB, _OWN_JOB.grasp_log_id == _OWN.id)
        .join(_COPY_JOB, _COPY_JOB.grasp_log_id == _COPY.id)
        .outerjoin(_OWN_SAMPLES, _OWN_SAMPLES.grasp_log_id == _OWN.id)
        .outerjoin(_COPY_SAMPLES, _COPY_SAMPLES.grasp_log_id == _COPY.id)
        .where(*of_these, _OWN.withdrawn_at.is_(None), _COPY.withdrawn_at.is_(None))
        .where(_OWN_JOB.finished_at.is_not(None), case((own_has, others), else_=instead))
        .order_by(_OWN.id, copy_has.desc(), _COPY.id)
    )
    return [(own, copy) for own, copy in session.execute(query.with_for_update(of=(_OWN, _COPY)))]


def _change_places(session: Session, pairs: Sequence[tuple[GraspLogRow, GraspLogRow]]) -> None:
    """Let the logs of each pair, alike but for it, change their materials: no two may be alike meanwhile."""
    contents = [one.sha256 for one, _ in pairs]
    for one, _ in pairs:
        one.sha256 = uuid.uuid4().hex
    session.flush()
    for one, other in pairs:
        one.material_id, other.material_id = other.material_id, one.material_id
    session.flush()
    for (one, _), sha256 in zip(pairs, contents, strict=True):
        one.sha256 = sha256
    session.flush()
