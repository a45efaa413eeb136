"""What an access key has stored and asked for."""

from collections.abc import Collection
from datetime import datetime

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from db.records import AuditAction
from db.tables import AuditEntryRow, GraspLogRow, JobRow


def queued_jobs(session: Session, key_id: str) -> int:
    """Jobs of the key that wait for a runner."""
    of_key = (JobRow.status == "queued", JobRow.requested_by == key_id)
    return session.scalar(select(func.count()).select_from(JobRow).where(*of_key)) or 0


def logs_since(session: Session, key_id: str, moment: datetime) -> int:
    """Logs that the key has stored at this moment or later."""
    of_key = (GraspLogRow.uploaded_by == key_id, GraspLogRow.created_at >= moment)
    return session.scalar(select(func.count()).select_from(GraspLogRow).where(*of_key)) or 0


def stored_bytes(session: Session, key_id: str) -> int:
    """Bytes of the uploads of the key that are still there."""
    of_key = (GraspLogRow.uploaded_by == key_id, GraspLogRow.file_state.is_(None))
    return int(session.scalar(select(func.coalesce(func.sum(GraspLogRow.bytes), 0)).where(*of_key)) or 0)


def changes_since(session: Session, key_id: str, actions: Collection[AuditAction], moment: datetime) -> int:
    """What the key has changed at this moment or later, as the audit trail has it."""
    of_key = (AuditEntryRow.actor == f"key:{key_id}", AuditEntryRow.at >= moment, AuditEntryRow.action.in_(actions))
    return session.scalar(select(func.count()).select_from(AuditEntryRow).where(*of_key)) or 0
