"""Which blobs the database refers to."""

from collections.abc import Iterator, Sequence

from sqlalchemy import select, union
from sqlalchemy.orm import Session

from db.tables import DetectionRow, GraspLogRow, SampleSummaryRow

_COLUMNS = (GraspLogRow.sha256, DetectionRow.history_blob, SampleSummaryRow.samples_blob)


def referenced(session: Session, hashes: Sequence[str]) -> set[str]:
    """Those of ``hashes`` that a row refers to."""
    return set(session.scalars(union(*(select(column).where(column.in_(hashes)) for column in _COLUMNS))))


def all_referenced(session: Session) -> Iterator[str]:
    """All that any row refers to, each once."""
    return iter(session.scalars(union(*(select(column) for column in _COLUMNS)).execution_options(yield_per=1000)))
