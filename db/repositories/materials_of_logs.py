"""Which material a log is of, and how to hold it while the log, its job or the models are changed."""

from sqlalchemy import select
from sqlalchemy.orm import Session, aliased

from db.errors import NotFound
from db.repositories import friction_models
from db.tables import GraspLogRow, MaterialRow


def get(session: Session, log_id: str) -> int | None:
    """The key of a log's material, if it has one; raises ``NotFound``."""
    found = session.execute(select(GraspLogRow.material_id).where(GraspLogRow.id == log_id)).one_or_none()
    if found is None:
        raise NotFound("grasp log", log_id)
    return found[0]


def hold(session: Session, log_id: str) -> int | None:
    """The key of a log's material, which nobody merges, nor changes its models, until the transaction ends.

    Whoever changes logs, models or jobs of a material holds it first, or two would wait for each other. None for a log
    of none; raises ``NotFound``.
    """
    material_id = get(session, log_id)
    if material_id is None:
        return None
    with session.begin_nested() as attempt:
        friction_models.lock(session, material_id)
        if get(session, log_id) == material_id:
            return material_id
        attempt.rollback()  # it was merged, and its log with it, while this waited
    return hold(session, log_id)


def counts_instead(session: Session, log_id: str) -> str | None:
    """The id of the log that counts in place of one that a merge left behind: of the same content and detector, of the
    material that its own was merged into, and not withdrawn. None where there is no such log.
    """
    left, there = aliased(GraspLogRow), GraspLogRow
    material_id = get(session, log_id)
    merged_into = select(MaterialRow.merged_into_id)
    while material_id is not None:
        material_id = session.scalar(merged_into.where(MaterialRow.id == material_id))
        same = there.sha256 == left.sha256, there.detector == left.detector, there.withdrawn_at.is_(None)
        of_it = select(there.id).join(left, left.id == log_id).where(there.material_id == material_id, *same)
        if material_id is not None and (found := session.scalar(of_it)) is not None:
            return found
    return None
