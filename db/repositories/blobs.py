"""Which blobs the database refers to."""

from collections.abc import Sequence

from sqlalchemy import select, union
from sqlalchemy.orm import Session

from db.tables import DetectionRow, GraspLogRow, SampleSummaryRow


def referenced(session: Session, hashes: Sequence[str]) -> set[str]:
    """Those of ``hashes`` that a row refers to."""
    columns = (GraspLogRow.sha256, DetectionRow.history_blob, SampleSummaryRow.samples_blob)
    return set(session.scalars(union(*(select(column).where(column.in_(hashes)) for column in columns))))
