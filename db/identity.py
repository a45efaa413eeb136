"""The id that a database and the blob store of its files share: neither works with another.

A server with the wrong database, or in the wrong folder, would take every file for one that nobody needs, or accept
uploads that no worker finds. The database has the id in a row, the folder in the file ``blobs/store-id``, an object
store in an object of that name. An id is made once, for two that belong together by what they hold; no other database
ever has it, also not one that is restored from a backup.
"""

import uuid
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice

from sqlalchemy.orm import Session

from db.blobs import BlobStore
from db.database import Database
from db.defaults import HASHES_PER_QUERY
from db.errors import StoreMismatch
from db.records import Actor
from db.repositories import audit, grasp_logs, stores
from db.repositories import blobs as references

REMEDY = "name the database and the data folder (or object store) of one service, or join these by `stiction db adopt`"


@dataclass(frozen=True, slots=True)
class AdoptedStore:
    """What was joined by hand: how many files are there, to how many the database refers, and how many of them miss."""

    store_id: str
    present: int
    referenced: int
    missing: int


def join(database: Database, blobs: BlobStore, *, alone: bool, to_fill: bool = False) -> None:
    """Make sure that the two belong together, and from now on say so; ``alone``: nobody else works in the folder.

    Two without an id get one if all that the database refers to is there, and if nothing is there that it cannot
    know, but for a database ``to_fill`` from a backup. Raises ``StoreMismatch``.
    """
    with database.write() as session:
        stores.lock(session)
        known, found = stores.find_id(session), blobs.read_store_id()
        if known is None:
            has_begun = alone and not blobs.is_settled and _is_new(session, blobs)  # and died before the row was there
            _require_same(database, blobs, known, None if has_begun else found)
            if not to_fill:
                _require_consistent(session, database, blobs)
            known = uuid.uuid4().hex
            blobs.write_store_id(known, settled=False)  # before the row: a start that dies in between can begin anew
            stores.set_id(session, known)
        else:
            _require_same(database, blobs, known, found)
    _require_same(database, blobs, known, blobs.read_store_id())  # another machine may have begun there meanwhile
    if not blobs.is_settled:
        blobs.write_store_id(known)  # no other database gets the blobs from here on, though there are none yet
    database.store_id = blobs.store_id = known


def check_to_fill(database: Database, blobs: BlobStore) -> None:
    """Make sure that the two can be joined to be filled, and change neither; raises ``StoreMismatch``."""
    known = _known_in_any_schema(database)
    has_begun = known is None and not blobs.is_settled and next(blobs.hashes(), None) is None
    _require_same(database, blobs, known, None if has_begun else blobs.read_store_id())


def verify(database: Database, blobs: BlobStore) -> None:
    """Make sure that the two belong together, or have not been joined yet; raises ``StoreMismatch``."""
    with database.read() as session:
        known = stores.find_id(session)
    _require_same(database, blobs, known, blobs.read_store_id())
    database.store_id = blobs.store_id = known


def verify_before_upgrade(database: Database, blobs: BlobStore) -> None:
    """The same for a database of any older schema, or of none: it must not be changed beside the files of another.

    One that is not there is not made either.
    """
    known, has_logs = _known_in_any_schema(database), False
    if not database.is_missing:
        with database.read() as session:
            has_logs = grasp_logs.any_in_older_schema(session)
    has_files = next(blobs.hashes(), None) is not None
    if known is not None or has_files or blobs.is_settled:
        _require_same(database, blobs, known, blobs.read_store_id())
    if known is None and has_files and not has_logs:
        raise _refers_to_none(database, blobs)


def _known_in_any_schema(database: Database) -> str | None:
    """The store id of a database whose schema may be older or not there yet; a file that is not there is not made."""
    if database.is_missing:
        return None
    with database.read() as session:
        return stores.find_id(session) if stores.has_table(session) else None


def adopt(database: Database, blobs: BlobStore, actor: Actor | None) -> AdoptedStore:
    """Join two because somebody says so, under a new id: whatever else worked with either is refused from then on.

    The audit trail records that ``actor`` did so; None: the caller, who is about to fill the tables, adds that entry.
    """
    store_id = uuid.uuid4().hex
    with database.write() as session:
        stores.lock(session)
        present, referenced, missing = count_files(session, blobs)
        blobs.write_store_id(store_id)
        stores.set_id(session, store_id)
        if actor is not None:
            audit.add(session, actor, "store.adopted", store_id, {"referenced": referenced, "missing": missing})
    database.store_id = blobs.store_id = store_id
    return AdoptedStore(store_id, present, referenced, missing)


def count_files(session: Session, blobs: BlobStore) -> tuple[int, int, int]:
    """How many blobs are there, to how many the database refers, and how many of those are not there."""
    present, count, missing = set(blobs.hashes()), 0, 0
    for sha256 in wanted(session):
        count += 1
        missing += sha256 not in present
    return len(present), count, missing


def wanted(session: Session) -> Iterator[str]:
    """Hashes of all that rows refer to, some at a time."""
    everything = references.all_referenced(session)
    while some := list(islice(everything, HASHES_PER_QUERY)):
        yield from some


def _is_new(session: Session, blobs: BlobStore) -> bool:
    """Whether neither has anything."""
    return not references.any_referenced(session) and next(blobs.hashes(), None) is None


def _require_consistent(session: Session, database: Database, blobs: BlobStore) -> None:
    """That two of before there were ids are of one service."""
    present, referenced, missing = count_files(session, blobs)
    if missing:
        what = f"{missing} of the {referenced} files that {database} refers to are not in {blobs}"
        raise StoreMismatch(f"{what}; allowed: {REMEDY}")
    if present and not referenced:
        raise _refers_to_none(database, blobs)


def _refers_to_none(database: Database, blobs: BlobStore) -> StoreMismatch:
    allowed = f"{REMEDY}, or, where the database is lost, fill an empty one by `stiction db restore --take-over`"
    return StoreMismatch(f"{blobs} has files, and {database} refers to none; allowed: {allowed}")


def _require_same(database: Database, blobs: BlobStore, known: str | None, found: str | None) -> None:
    if found != known:
        what = f"{database} is of {_named(known)}, and {blobs} of {_named(found)}"
        raise StoreMismatch(f"{what}; allowed: {REMEDY}")
    if (cached := blobs.cached_store_id()) not in (None, known):
        what = f"the data folder, to be the cache of {blobs}, holds the files of {_named(cached)}"
        raise StoreMismatch(f"{what}; allowed: a folder of its own")


def _named(store_id: str | None) -> str:
    return "no store yet" if store_id is None else f"store {store_id}"
