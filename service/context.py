"""What a request has to work with."""

from dataclasses import dataclass, field
from typing import Annotated

from fastapi import Depends, Request

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


async def _context(request: Request) -> Context:
    context: Context = request.app.state.context
    return context


Given = Annotated[Context, Depends(_context)]
