"""What the use cases have to work with."""

import asyncio
from collections import Counter
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Protocol

from sqlalchemy.orm import Session

from db import free_room
from db.blobs import BlobStore
from db.database import Database
from service.domain.models.model_cache import ModelCache
from service.domain.resources.receive import Bodies
from service.formats.reading import Readers
from service.processes.fair_threads import FairThreads
from service.settings import Settings


class Jobs(Protocol):
    """Who does the jobs that are queued."""

    @property
    def missing(self) -> str | None:
        """What it waits for before it can do any, None if nothing."""

    def wake(self) -> None:
        """Look for a job soon, since one has just been stored; may be called from any thread."""

    def ending(self, job_id: str) -> asyncio.Event:
        """Set once this job is done here; jobs that are done elsewhere end unheard."""

    async def until_outdated(self) -> None:
        """Raise ``SchemaMismatch`` once the schema is not this version's any more."""


@dataclass(frozen=True, slots=True)
class Context:
    """The open stores and the running jobs of one application.

    ``threads``: for all that is done on a client's behalf; ``store_threads``: for what of it waits for the blobs'
    store, which may hang; ``waits``: of each client for jobs, at the moment.
    """

    settings: Settings
    database: Database
    blobs: BlobStore
    jobs: Jobs
    readers: Readers = field(default_factory=Readers)
    models: ModelCache = field(default_factory=ModelCache)
    bodies: Bodies = field(default_factory=Bodies)
    threads: FairThreads = field(default_factory=FairThreads)
    store_threads: FairThreads = field(default_factory=FairThreads)
    waits: Counter[str] = field(default_factory=Counter)

    async def files(self, owner: str, hashes: Iterable[str], checked_within: float = 0.0) -> list[Path]:
        """The files that hold these blobs, for a client; each is compared with its hash (``BlobStore.path``)."""

        def find() -> list[Path]:
            return [self.blobs.path(sha256, checked_within) for sha256 in hashes]

        return await self.store_threads.run(owner, find, is_long=True)

    def require_room(self) -> None:
        """Make sure that there is room for an upload and what follows from it; raises ``StorageUnavailable``."""
        free_room.require(self.database, self.blobs, self.settings.least_free_bytes)

    @contextmanager
    def queueing(self) -> Iterator[Session]:
        """A transaction in which jobs are queued; who does them is woken after it."""
        with self.database.write() as session:
            yield session
        self.jobs.wake()
