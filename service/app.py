"""The application: stores opened, jobs taken up, routes and problems put together."""

import logging
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, closing

from fastapi import FastAPI

from db import migrate
from db.blobs import BlobStore, open_blobs
from db.database import Database
from db.repositories import blobs as blob_references
from service import access, gate, openapi, problems
from service.context import Context
from service.envelope import Envelope
from service.folder_lock import locked
from service.gate import Gate
from service.head_requests import HeadRequests
from service.jobs import JobPool
from service.model_cache import ModelCache
from service.reading import Readers
from service.routes import curation, grasp_logs, health, jobs, materials, planning
from service.settings import Settings
from service.worker import Place

logger = logging.getLogger(__name__)

DESCRIPTION = """Friction of what a robot holds, identified from the micro-slips of a grasp that still holds.

Upload grasp logs of a material, wait for their jobs, and look up the friction coefficient. SI units throughout.
Errors are problem details (RFC 9457) with stable types."""


def create_app(settings: Settings | None = None) -> FastAPI:
    """The web service as an ASGI application; without ``settings``, those of the environment."""
    chosen = settings or Settings()

    @asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncIterator[None]:
        async with running(chosen) as context:
            app.state.context = context
            yield

    app = openapi.DescribedApp(
        title="Stiction",
        description=DESCRIPTION,
        version="1",
        lifespan=lifespan,
        redirect_slashes=False,
        generate_unique_id_function=openapi.operation_id,
    )
    for module in (health, materials, grasp_logs, curation, planning, jobs):
        app.include_router(module.router)
    access.check_routes(app)
    app.add_middleware(Gate, settings=chosen)
    app.add_middleware(HeadRequests)
    app.add_middleware(Envelope)
    problems.install(app)
    return app


@asynccontextmanager
async def running(settings: Settings) -> AsyncIterator[Context]:
    """Open the stores, leave no orphan in them, take up unfinished jobs; at the end, stop in the opposite order."""
    with locked(settings.data_folder), closing(Database(settings.resolved_database_url)) as database:
        if settings.migrate_at_start:
            migrate.upgrade(database)
        else:
            migrate.check(database)
        gate.check_start(settings, database)
        blobs = open_blobs(settings.data_folder, settings.blob_url, settings.blob_cache_bytes)
        _sweep(database, blobs)
        pool = JobPool(
            database,
            Place(database.url, settings.data_folder, settings.blob_url, settings.blob_cache_bytes),
            workers=settings.workers,
            attempts=settings.job_attempts,
            shutdown_seconds=settings.shutdown_seconds,
        )
        readers = Readers(settings.read_seconds)
        await pool.start()
        try:
            yield Context(settings, database, blobs, pool, readers, ModelCache(settings.lookup_seconds))
        finally:
            await pool.stop()
            await readers.stop()


def _sweep(database: Database, blobs: BlobStore) -> None:
    def referenced(hashes: list[str]) -> set[str]:
        with database.read() as session:
            return blob_references.referenced(session, hashes)

    for sha256 in blobs.sweep(referenced):
        logger.info("removed blob %s, to which nothing refers", sha256)
