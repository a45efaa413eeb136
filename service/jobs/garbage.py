"""Blobs to which nothing refers: set aside, and deleted some time after that, by an order or a policy only.

They come of uploads whose server died before their row was written, and of results whose job was cancelled. What is
set aside is found by readers as before, so that an error here is mended and no loss.
"""

from collections.abc import Callable, Iterator
from datetime import timedelta
from itertools import islice

from db import identity
from db.blobs import BlobStore
from db.database import Database
from db.defaults import HASHES_PER_QUERY, ORPHAN_AGE
from db.errors import StoreMismatch
from db.records import Actor
from db.repositories import audit
from db.repositories import blobs as references


def find_unreferenced(database: Database, blobs: BlobStore, age: timedelta = ORPHAN_AGE) -> Iterator[str]:
    """Hashes of blobs older than ``age`` that no row refers to; raises ``StoreMismatch`` where all would be."""
    _require_references(database, blobs)
    for some in _portions(blobs.hashes(blobs.now() - age)):
        yield from sorted(set(some) - _referenced(database, some))


def set_aside(
    database: Database, blobs: BlobStore, age: timedelta = ORPHAN_AGE, stop: Callable[[], bool] = lambda: False
) -> int:
    """Move them into the quarantine; returns how many."""
    count = 0
    for sha256 in find_unreferenced(database, blobs, age):
        if stop():
            break
        blobs.quarantine.put(sha256)
        count += 1
    return count


def find_deletable(database: Database, blobs: BlobStore, grace: timedelta) -> Iterator[str]:
    """Hashes of those set aside for longer than ``grace``; what is referred to after all comes back to its place."""
    _require_references(database, blobs)
    for some in _portions(blobs.quarantine.hashes(blobs.now() - grace)):
        needed = _referenced(database, some)
        for sha256 in needed:
            blobs.quarantine.recall(sha256)
        yield from sorted(set(some) - needed)


def delete_set_aside(database: Database, blobs: BlobStore, grace: timedelta, actor: Actor = audit.SERVICE) -> int:
    """Delete them for good; returns how many. The audit trail records that ``actor`` did so, before it is done."""
    count = 0
    for some in _portions(find_deletable(database, blobs, grace)):
        details = {"files": len(some), "grace_seconds": grace.total_seconds()}
        with database.write() as session:
            audit.add(session, actor, "quarantine.deleted", blobs.store_id or "", details)
        blobs.quarantine.delete(some)
        count += len(some)
    return count


def _require_references(database: Database, blobs: BlobStore) -> None:
    """That the database is the one of these blobs; one that knows none of them cannot say of any that it may go."""
    identity.verify(database, blobs)
    with database.read() as session:
        if references.any_referenced(session):
            return
    if next(blobs.hashes(), None) is not None or next(blobs.quarantine.hashes(), None) is not None:
        raise StoreMismatch(f"{database} refers to no file, and {blobs} has some; allowed: to delete them by hand")


def _referenced(database: Database, hashes: list[str]) -> set[str]:
    with database.read() as session:
        return references.referenced(session, hashes)


def _portions(hashes: Iterator[str]) -> Iterator[list[str]]:
    while some := list(islice(hashes, HASHES_PER_QUERY)):
        yield some
