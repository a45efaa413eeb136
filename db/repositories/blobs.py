"""Which blobs the database refers to."""

from collections.abc import Iterator, Sequence

from sqlalchemy import Select, select, union
from sqlalchemy.orm import Session

from db.tables import DetectionRow, GraspLogRow, SampleSummaryRow


def referenced(session: Session, hashes: Sequence[str]) -> set[str]:
    """Those of ``hashes`` that a row refers to."""
    return set(session.scalars(union(*(query.where(query.selected_columns[0].in_(hashes)) for query in _queries()))))


def all_referenced(session: Session) -> Iterator[str]:
    """All that any row refers to, each once."""
    return iter(session.scalars(union(*_queries()).execution_options(yield_per=1000)))


def any_referenced(session: Session) -> bool:
    """Whether any row refers to any."""
    return any(session.scalar(query.limit(1)) is not None for query in _queries())


def _queries() -> tuple[Select[str], ...]:
    """Uploads, but for those that go or are gone, and what was found in them."""
    files = select(GraspLogRow.sha256).where(GraspLogRow.file_state.is_(None))
    return files, select(DetectionRow.history_blob), select(SampleSummaryRow.samples_blob)
