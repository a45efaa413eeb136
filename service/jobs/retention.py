"""Delete uploads once they are old: what was found in them stays, and fits need no more than that.

Also, where that is wanted, files to which nothing refers (``service.jobs.garbage``), and the audit trail's old entries.
"""

import logging
import time
from collections.abc import Callable
from datetime import datetime, timedelta

from db.blobs import BlobStore
from db.database import Database
from db.errors import DatabaseError
from db.records import Actor
from db.repositories import audit, uploads
from db.tables import now
from service.jobs import garbage
from service.jobs.steady_clock import SteadyClock
from service.periodic_thread import PeriodicThread

logger = logging.getLogger(__name__)

LOOK_SECONDS = 60.0
"""s between two looks for uploads that have grown old."""

GARBAGE_SECONDS = 3600.0
"""s between two looks for files to which nothing refers: each is a walk over all of them."""

FILES_AT_ONCE = 100
"""Files deleted in one transaction: others who write to SQLite wait for it."""


def prune(
    database: Database,
    blobs: BlobStore,
    before: datetime,
    stop: Callable[[], bool] = lambda: False,
    actor: Actor = audit.SERVICE,
) -> int:
    """Delete the files of all logs older than ``before`` whose jobs have ended; returns how many.

    The audit trail records that ``actor`` did so.
    Ends early once ``stop`` says so. May run at any number of places at once, and be killed at any moment.
    """
    deleted = 0
    while not stop():
        with database.write(durable=False) as session:
            marked = uploads.mark(session, before, FILES_AT_ONCE)
        count = _delete_marked(database, blobs, actor)
        deleted += count
        if not marked and not count:
            break
    return deleted


def _delete_marked(database: Database, blobs: BlobStore, actor: Actor) -> int:
    """The files that were marked, by us or by one who died since."""
    with database.read() as session:
        marked = uploads.leaving(session, FILES_AT_ONCE)
    if not marked:
        return 0
    with database.write(durable=False) as session:
        uploads.lock(session, marked)
        free = uploads.spare_needed(session, marked)
        blobs.remove(free)
        for log_id, sha256 in uploads.note_gone(session, free):
            audit.add(session, actor, "grasp_log.file_deleted", log_id, {"sha256": sha256})
    return len(free)


class Retention:
    """Prunes now and then, in whichever process ``leads`` the others.

    ``days``: after which uploads go; ``unreferenced_days``: after which files to which nothing refers do;
    ``audit_days``: after which entries of the audit trail do. Not while the clock may be wrong (``SteadyClock``).
    """

    def __init__(
        self,
        database: Database,
        blobs: BlobStore,
        days: float | None,
        leads: Callable[[], bool],
        unreferenced_days: float | None = None,
        audit_days: float | None = None,
    ) -> None:
        self._database, self._blobs, self._leads = database, blobs, leads
        self._age = None if days is None else timedelta(days=days)
        self._grace = None if unreferenced_days is None else timedelta(days=unreferenced_days)
        self._audit_age = None if audit_days is None else timedelta(days=audit_days)
        self._next_garbage, self._clock = 0.0, SteadyClock(database)
        self._thread = PeriodicThread("retention", LOOK_SECONDS, self._look)

    def start(self) -> None:
        """Begin, also where all is kept for good: the webhook and the command go by whether the clock was watched."""
        try:
            self._clock.begin()
        except DatabaseError as error:
            logger.warning("the clock is not looked at: %s", error)
        self._thread.start()

    async def stop(self) -> None:
        """End after the files that are being deleted."""
        await self._thread.stop()

    def _look(self) -> None:
        try:
            if not self._leads() or not self._clock.is_believed():
                return
            if self._age is not None:
                self._prune(self._age)
            if self._audit_age is not None:
                self._forget_changes(self._audit_age)
            if self._grace is not None and time.monotonic() >= self._next_garbage:
                self._collect_garbage(self._grace)
        except DatabaseError as error:
            logger.warning("nothing old is deleted: %s", error)
        except Exception:
            logger.exception("nothing old is deleted")

    def _prune(self, age: timedelta) -> None:
        if deleted := prune(self._database, self._blobs, now() - age, self._is_to_end):
            logger.info("deleted %d uploads older than %s", deleted, age)

    def _is_to_end(self) -> bool:
        return self._thread.is_stopping or not self._leads()

    def _forget_changes(self, age: timedelta) -> None:
        with self._database.write(durable=False) as session:
            deleted = audit.delete_before(session, now() - age)
        if deleted:
            logger.info("deleted %d entries of the audit trail older than %s", deleted, age)

    def _collect_garbage(self, grace: timedelta) -> None:
        self._next_garbage = time.monotonic() + GARBAGE_SECONDS
        if deleted := garbage.delete_set_aside(self._database, self._blobs, grace):
            logger.info("deleted %d files that nothing referred to for %s", deleted, grace)
        if count := garbage.set_aside(self._database, self._blobs, stop=self._is_to_end):
            logger.info("set %d files aside, to which nothing refers", count)
