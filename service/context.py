"""What the use cases have to work with."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

from sqlalchemy.orm import Session

from db.blobs import BlobStore
from db.database import Database
from service.domain.model_cache import ModelCache
from service.domain.receive import Bodies
from service.formats.reading import Readers
from service.jobs.runner import JobRunner
from service.jobs.scrub import Scrub
from service.observability.store_watch import StoreWatch
from service.settings import Settings
from service.stream.sessions import Streams


@dataclass(frozen=True, slots=True)
class Context:
    """The open stores and the running jobs of one application."""

    settings: Settings
    database: Database
    blobs: BlobStore
    jobs: JobRunner
    readers: Readers = field(default_factory=Readers)
    streams: Streams = field(default_factory=Streams)
    models: ModelCache = field(default_factory=ModelCache)
    scrub: Scrub | None = None
    watch: StoreWatch | None = None
    bodies: Bodies = field(default_factory=Bodies)

    @contextmanager
    def queueing(self) -> Iterator[Session]:
        """A transaction in which jobs are queued; who does them is woken after it."""
        with self.database.write() as session:
            yield session
        self.jobs.wake()
