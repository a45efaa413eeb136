"""Which material a log is of, and how to hold it while the log, its job or the models are changed."""

from sqlalchemy import select
from sqlalchemy.orm import Session

from db.errors import NotFound
from db.repositories import friction_models
from db.tables import GraspLogRow


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
