"""What tests of SQLite's file do to a database, and see of it."""

from pathlib import Path

from db.database import Database
from db.file_header import PAGE_BYTES, FileHeader
from db.repositories import stores


def look(database: Database, times: int = 1) -> None:
    """Write as the service's look at its stores does."""
    for _ in range(times):
        with database.write() as session:
            stores.touch(session)


def header_of(path: Path) -> FileHeader:
    """In the file, whatever is in its log."""
    return FileHeader.of_page(path.read_bytes()[:PAGE_BYTES])
